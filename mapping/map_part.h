// Deformed body -> its deformed surface, parted where it broke, and a report: what flexel-map does.
#pragma once
#include <optional>

#include "base/program/progress.h"
#include "mapping/crack/crack.h"
#include "mapping/methods/bind.h"
#include "mapping/types/options.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// A surface and where its vertices go.
struct MappedPart {
  MapResult result;
  MapReport report;
  std::optional<CrackedSurface> cracked;  // `open` and `cap`, where a part is in fragments or cracked
  std::optional<Surface> refined;         // in place of the body's, whose triangles were split for it
  std::string split_line;                 // says so, or why it was not
  [[nodiscard]] const Surface& surface(const Body& body) const {
    return cracked ? cracked->surface : refined ? *refined : body.surface;
  }
};

// Maps the deformed state of `body` onto its surface, parted as `crack` says, and reports on it. While it
// works the body holds the parted surface; it gets its own back. `known`: the binding of a surface that stays
// whole (CrackMode::keep), where there is one. Throws as part_surface() and map_surface().
[[nodiscard]] MappedPart map_part(Body& body, const MapOptions& options, const CrackOptions& crack,
                                  Progress& progress, const Binding* known = nullptr);

}  // namespace flexel::mapping
