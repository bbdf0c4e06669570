// The unit in the last place of the largest coordinate, in the file's unit.
#include "formats/exchange/resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/ply/ply_text.h"

namespace flexel {
namespace {

bool is_single_precision(const SurfaceSource& source) {
  if (source.format == "stl-binary") return true;
  if (source.format != "ply-binary" || source.bytes.empty()) return false;
  const PlyHeader header = parse_ply_header(source.bytes, source.file);
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertex == header.elements.end()) return false;
  const std::size_t x = vertex_layout(*vertex).position[0];
  return x != kNoProperty && vertex->properties[x].type == PlyType::float32;
}

}  // namespace

double coordinate_resolution(const Surface& surface, std::size_t part) {
  if (part >= surface.part_source.size()) return 0;
  const SurfaceSource& source = surface.sources[surface.part_source[part]];
  if (!is_single_precision(source)) return 0;
  double farthest = 0;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (surface.polygon_part(p) == part)
      for (const std::uint32_t v : surface.polygon(p))
        farthest = std::max(farthest, surface.vertices[v].cwiseAbs().maxCoeff());
  const auto number = static_cast<float>(farthest / source.unit);
  return (std::nextafter(number, std::numeric_limits<float>::max()) - number) * source.unit;
}

}  // namespace flexel
