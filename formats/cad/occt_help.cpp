// STEP is text between two fixed lines; a truncated file lacks the second.
#include "formats/cad/occt_help.h"

#include <algorithm>

#include "base/error.h"
#include "formats/part/topology.h"

namespace flexel {

void check_step_complete(const ImportInput& input) {
  const std::string_view text(reinterpret_cast<const char*>(input.bytes.data()), input.bytes.size());
  if (text.rfind("END-ISO-10303-21") == std::string_view::npos)
    throw InputError(input.where, text.find("ISO-10303-21") == std::string_view::npos
                                      ? "is no STEP file: it does not begin with ISO-10303-21"
                                      : "is cut off: a STEP file ends with END-ISO-10303-21");
}

void orient_outward(Surface& surface, std::size_t first_polygon) {
  std::vector<std::array<std::uint32_t, 3>> corners;
  for (std::size_t p = first_polygon; p < surface.polygon_count(); ++p) {
    const auto polygon = surface.polygon(p);
    corners.push_back({polygon[0], polygon[1], polygon[2]});
  }
  if (signed_volume(surface.vertices, corners) >= 0) return;
  for (std::size_t p = first_polygon; p < surface.polygon_count(); ++p)
    std::swap(surface.polygon_vertices[3 * p + 1], surface.polygon_vertices[3 * p + 2]);
}

}  // namespace flexel
