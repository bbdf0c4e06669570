// The unit in the last place of the largest coordinate, in the file's unit.
#include "formats/exchange/resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/common/file_formats.h"

namespace flexel {
namespace {

bool is_single_precision(const SurfaceSource& source) {
  const FileFormat* format = format_of(source);
  return format != nullptr && format->in_single_precision != nullptr && format->in_single_precision(source);
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
