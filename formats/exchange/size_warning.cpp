// Sizes of parts against what people make, and the unit that would bring them there.
#include "formats/exchange/size_warning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/units.h"
#include "formats/common/file_formats.h"

namespace flexel {
namespace {

constexpr std::pair<const char*, double> kUnits[] = {{"mm", 1e-3}, {"m", 1.0},     {"in", 0.0254},
                                                     {"cm", 1e-2}, {"ft", 0.3048}, {"um", 1e-6}};

// The unit in which `extent` (numbers of the file) is nearest to 100 mm, on a logarithmic scale.
const char* likely_unit(double extent) {
  constexpr double kUsual = 0.1;  // m
  const auto distance = [&](const auto& unit) { return std::abs(std::log(extent * unit.second / kUsual)); };
  return std::min_element(std::begin(kUnits), std::end(kUnits),
                          [&](const auto& a, const auto& b) { return distance(a) < distance(b); })
      ->first;
}

std::string name_of(double unit) {
  for (const auto& [name, metres] : kUnits)
    if (std::abs(metres - unit) <= 1e-12 * unit) return name;
  return fmt::format("{:g} m", unit);
}

}  // namespace

std::vector<std::string> size_warnings(const Surface& surface) {
  std::vector<Box> boxes(surface.parts.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (const std::uint32_t v : surface.polygon(p)) boxes[surface.polygon_part(p)].add(surface.vertices[v]);
  std::vector<double> extents(surface.sources.size(), 0);
  for (std::size_t part = 0; part < boxes.size(); ++part) {
    double& extent = extents[surface.part_source[part]];
    extent = std::max(extent, boxes[part].size().maxCoeff());
  }
  std::vector<std::string> lines;
  for (std::size_t s = 0; s < extents.size(); ++s) {
    const double extent = extents[s];
    const SurfaceSource& source = surface.sources[s];
    const bool assumed = !carries_unit(source) && !source.unit_given;
    if (assumed && extent >= kSuspiciouslySmall && extent < kSmallWithoutUnit) {
      const double numbers = extent / source.unit;
      lines.push_back(
          fmt::format("{} is {} long in {}, the unit for files that carry none: if the file is in metres add "
                      "--unit m ({}), "
                      "if in inches --unit in ({})",
                      source.file, human_length(extent), name_of(source.unit), human_length(numbers),
                      human_length(0.0254 * numbers)));
      continue;
    }
    if (!(extent > 0) || (extent >= kSuspiciouslySmall && extent <= kSuspiciouslyLarge)) continue;
    const std::string likely = likely_unit(extent / source.unit), unit = name_of(source.unit);
    const std::string size = fmt::format("{} is {} across in {}", source.file, human_length(extent), unit);
    if (carries_unit(source))
      lines.push_back(
          fmt::format("{}, the unit that it carries: its numbers are likely {}; export it in its "
                      "true unit, or as STL",
                      size, likely));
    else if (likely == unit)
      lines.push_back(size);
    else
      lines.push_back(fmt::format("{}{}: likely --unit {}", size,
                                  source.unit_given ? "" : ", the unit for files that carry none", likely));
  }
  return lines;
}

}  // namespace flexel
