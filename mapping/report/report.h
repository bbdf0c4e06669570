// The validity report of a mapping, as text and as JSON.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "mapping/types/options.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// `cut`: the surface in the body is not its own but was cut along cracks (mapping/crack/crack.h).
[[nodiscard]] MapReport report(const Body& body, const MapResult& result, bool cut = false);
// For people: first a sentence that says whether the mapping can be used and why, then the figures worth a
// look.
[[nodiscard]] std::vector<std::string> report_lines(const MapReport& report);
// Every key and unit is in docs/reference/mapping.md.
[[nodiscard]] std::string report_json(const MapReport& report, const MapOptions& options);
// The same as a table of two columns, for reading.
[[nodiscard]] std::string report_table(const MapReport& report, const MapOptions& options);

}  // namespace flexel::mapping
