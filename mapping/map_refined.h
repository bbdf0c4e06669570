// A mapping of a surface whose triangles are split where they are too large to show the deformation.
#pragma once
#include <span>

#include "formats/exchange/surface_file.h"
#include "formats/part/refinement.h"
#include "mapping/map_part.h"

namespace flexel::mapping {

struct RefineOptions {
  enum class Mode {
    off,        // the vertices of the file
    automatic,  // where the surface is coarse
    to_edge,    // until no edge is longer than `edge`
  };
  Mode mode = Mode::automatic;
  double edge = 0;     // m
  bool asked = false;  // the user said so
};

[[nodiscard]] std::size_t triangle_count(const Surface& surface);

// A surface with its polygons split, ready to be written; nothing where that cannot be done. And a line for the user.
struct SplitSurface {
  std::optional<Surface> surface;
  std::string line;
};
// Where the surface is to be written as its file, which cannot be split alike (refined_with_file()): that error where the
// user asked for it, else none and a line that says why.
[[nodiscard]] SplitSurface split_surface(const Surface& surface, const Refinement& refinement,
                                         const RefineOptions& options,
                                         std::span<const SurfaceFormat> formats);

// map_part(), and again on a surface that was split, as `refine` says; the body gets its own back. A surface that
// was cut along cracks is split by `to_edge` only. `written`: what is written in place of the body's surface (--onto).
// `formats`: those that it is written in. Throws as map_part() and split_surface().
[[nodiscard]] MappedPart map_refined(Body& body, const MapOptions& options, const CrackOptions& crack,
                                     const RefineOptions& refine, const Surface* written,
                                     std::span<const SurfaceFormat> formats, Progress& progress);

// A copy of the body whose polygons are split where those of its surface, mapped as `result`, are too large to show the
// deformation; nothing where none is.
[[nodiscard]] std::optional<Body> split_where_coarse(const Body& body, const MapResult& result,
                                                     Progress& progress);

// What all states of a series need together, and where nothing is split for them, why.
struct RefinedSeries {
  std::optional<Refinement> refinement;
  std::string line;
};
// `automatic`, of the surface and the parts of `first`. The frames are read for it, where the surface has triangles that
// could be coarse. `cut`: along cracks, so that the series is split only where no frame has any.
[[nodiscard]] RefinedSeries refinement_of_series(const Body& first, const std::vector<std::string>& files,
                                                 const MapOptions& options, bool cut, Progress& progress);

}  // namespace flexel::mapping
