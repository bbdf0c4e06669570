// Estimates from volume and surface area (memory.h has the formula).
#include "voxelize/memory.h"

#include <algorithm>
#include <cmath>

namespace flexel::voxelize {

double estimate_cells(const PartExtent& extent, double spacing, Placement placement) {
  const double inside = extent.volume / (spacing * spacing * spacing);
  return placement == Placement::centre ? inside : inside + .75 * extent.area / (spacing * spacing);
}

double spacing_for_cells(const std::vector<PartExtent>& extents, double cells, Placement placement) {
  const auto total = [&](double spacing) {
    double sum = 0;
    for (const PartExtent& extent : extents) sum += estimate_cells(extent, spacing, placement);
    return sum;
  };
  // The count falls with the spacing: bisect its logarithm.
  double low = -60, high = 60;
  for (int step = 0; step < 200; ++step) {
    const double middle = (low + high) / 2;
    (total(std::exp(middle)) > cells ? low : high) = middle;
  }
  return std::exp(high);
}

namespace {
constexpr double kProgram = 35e6;                                                      // bytes
constexpr double kPerCell = 4500, kPerCentreElement = 4200, kPerQuadraticCell = 36e3;  // bytes
double bytes_each(Placement placement, bool moments) {
  if (moments) return kPerQuadraticCell;
  return placement == Placement::corner ? kPerCell : kPerCentreElement;
}
}  // namespace

double simulation_memory(double cells, Placement placement, bool moments) {
  return kProgram + cells * bytes_each(placement, moments);
}

double cells_within(double bytes, Placement placement, bool moments) {
  return std::max(1., (bytes - kProgram) / bytes_each(placement, moments));
}

}  // namespace flexel::voxelize
