// Along lines through the part: distances from entry to exit.
#include "voxelize/walls.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "voxelize/classify/overlap.h"
#include "voxelize/heal/heal.h"
#include "voxelize/heal/outward.h"
#include "voxelize/mesh/line_crossings.h"

namespace flexel::voxelize {
namespace {

void add_samples(const PartMesh& mesh, const LineGrid& grid, double negligible,
                 std::vector<WallSample>& samples) {
  constexpr double kOpposite = -.985;  // cosine of 170 degrees
  const int u = (grid.axis + 1) % 3, v = (grid.axis + 2) % 3;
  const std::vector<LineCrossing> crossings = cross_lines(mesh, mesh.world, grid);
  int winding = 0;
  for (std::size_t n = 0; n + 1 < crossings.size(); ++n) {
    const LineCrossing &enter = crossings[n], &leave = crossings[n + 1];
    winding += enter.change;
    if (winding != 1 || enter.change != 1 || leave.change != -1 || enter.line != leave.line) continue;
    const Vec3 normal = unit_normal(mesh, enter.triangle);
    if (normal.dot(unit_normal(mesh, leave.triangle)) > kOpposite) continue;
    const double thickness = (leave.at - enter.at) * -normal[grid.axis];
    if (!(thickness > negligible)) continue;
    WallSample sample{thickness, (leave.at - enter.at) * grid.u_step * grid.v_step, Vec3::Zero()};
    sample.where[grid.axis] = enter.at;
    sample.where[u] = grid.u_begin + enter.line % static_cast<unsigned>(grid.u_count) * grid.u_step;
    sample.where[v] = grid.v_begin + enter.line / static_cast<unsigned>(grid.u_count) * grid.v_step;
    samples.push_back(sample);
  }
}

}  // namespace

std::vector<WallSample> wall_samples(const PartMesh& mesh, int lines) {
  const Box box = bounding_box(mesh.world);
  std::vector<WallSample> samples;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double u_step = box.size()[u] / lines, v_step = box.size()[v] / lines;
    if (!(u_step > 0) || !(v_step > 0)) continue;
    add_samples(mesh, {axis, box.min[u] + u_step / 2, box.min[v] + v_step / 2, u_step, v_step, lines, lines},
                1e-6 * box.diagonal(), samples);
  }
  return samples;
}

int wall_lines(int lines, std::size_t parts) {
  constexpr double kParts = 256;
  constexpr int kLeast = 16;
  if (static_cast<double>(parts) <= kParts) return lines;
  return std::max(kLeast, static_cast<int>(lines * std::sqrt(kParts / static_cast<double>(parts))));
}

double fifth_wall(std::vector<WallSample> samples, double volume) {
  constexpr double kShare = 0.2;
  std::sort(samples.begin(), samples.end(),
            [](const WallSample& a, const WallSample& b) { return a.thickness < b.thickness; });
  double matter = 0;
  for (const WallSample& each : samples)
    if ((matter += each.matter) > kShare * volume) return each.thickness;
  return std::numeric_limits<double>::infinity();
}

std::size_t thinnest_sample(const std::vector<WallSample>& samples) {
  const auto least =
      std::min_element(samples.begin(), samples.end(),
                       [](const WallSample& a, const WallSample& b) { return a.thickness < b.thickness; });
  return static_cast<std::size_t>(least - samples.begin());
}

}  // namespace flexel::voxelize
