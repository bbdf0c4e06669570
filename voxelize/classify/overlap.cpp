// Along a line, matter is where the running sum of crossings is above 0. Inside a voxel the winding
// number of a line along z follows from that at an inner point, along x and then y.
#include "voxelize/classify/overlap.h"

#include <algorithm>
#include <numeric>

#include "base/stop.h"
#include "voxelize/classify/moments.h"
#include "voxelize/mesh/line_crossings.h"

namespace flexel::voxelize {
namespace {

constexpr int kLines = 64;                   // across a voxel
constexpr double kTouchingCrossings = 1e-6;  // in cells

// Change of the winding number on the way from one coordinate of a line to another.
int change_between(std::span<const LineCrossing> crossings, double from, double to) {
  if (to < from) return -change_between(crossings, to, from);
  return std::accumulate(crossings.begin(), crossings.end(), 0, [&](int sum, const LineCrossing& crossing) {
    return sum + (crossing.at >= from && crossing.at < to ? crossing.change : 0);
  });
}

// Crossings of each line: (lines + 1) ends in the sorted list.
std::vector<std::size_t> line_begins(const std::vector<LineCrossing>& crossings, std::size_t lines) {
  std::vector<std::size_t> begin(lines + 1, 0);
  for (const LineCrossing& crossing : crossings) ++begin[crossing.line + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  return begin;
}

// Calls matter(from, to) for every stretch of [low, high] with winding > 0, starting from `winding` at low. True where
// another number than 0 and 1 was met.
template <class Matter>
bool walk(std::span<const LineCrossing> crossings, double low, double high, int winding,
          const Matter& matter) {
  bool overlap = false;
  double from = low;
  for (const LineCrossing& crossing : crossings) {
    if (crossing.at < low || crossing.at >= high) continue;
    if (winding > 0) matter(from, crossing.at);
    // Surfaces that touch may be met in either order: a winding number over no length is no overlap.
    if (winding != 0 && winding != 1 && crossing.at - from > kTouchingCrossings) overlap = true;
    winding += crossing.change;
    from = crossing.at;
  }
  if (winding > 0) matter(from, high);
  return overlap || (winding != 0 && winding != 1);
}

using Weights = std::array<double, kMomentPoints>;

// The integrals of the Lagrange polynomials over the strip of line n.
std::array<Weights, kLines> strip_weights() {
  std::array<Weights, kLines> strips{};
  for (int n = 0; n < kLines; ++n) {
    const Weights low = lagrange_tails(static_cast<double>(n) / kLines),
                  high = lagrange_tails(static_cast<double>(n + 1) / kLines);
    for (std::size_t i = 0; i < kMomentPoints; ++i) strips[n][i] = low[i] - high[i];
  }
  return strips;
}

}  // namespace

LineFill fill_by_lines(const VoxelRecords& voxel) {
  std::vector<std::uint32_t> triangles;
  for (const Record& record : voxel.records) triangles.push_back(record.triangle);
  const PartMesh& mesh = *voxel.mesh;
  constexpr double kStep = 1. / kLines;
  const Vec3 first = Vec3(voxel.i, voxel.j, voxel.k) + Vec3::Constant(kStep / 2);  // of the lines
  const Vec3 begin = first + Vec3(.3719, .6131, .4327);  // irregular: no ties with symmetric surfaces
  // Axis 0: (u, v) = (y, z). Axis 1: (u, v) = (z, x). Axis 2: (u, v) = (x, y).
  const auto along_x = cross_lines(mesh, mesh.vertices, {0, begin.y(), begin.z(), 1, 1, 1, 1}, triangles);
  const auto along_y =
      cross_lines(mesh, mesh.vertices, {1, begin.z(), first.x(), 1, kStep, 1, kLines}, triangles);
  const auto inside =
      cross_lines(mesh, mesh.vertices, {2, first.x(), first.y(), kStep, kStep, kLines, kLines}, triangles);
  const auto y_begin = line_begins(along_y, kLines), inside_begin = line_begins(inside, kLines * kLines);
  const int start = winding_at(voxel, begin);
  static const std::array<Weights, kLines> strips = strip_weights();
  LineFill sum;
  for (int b = 0; b < kLines; ++b) {
    std::array<Weights, kMomentPoints> plane{};  // along z, x: of the row of lines
    for (int a = 0; a < kLines; ++a) {
      const std::span<const LineCrossing> row{along_y.data() + y_begin[a], along_y.data() + y_begin[a + 1]};
      const std::size_t n = static_cast<std::size_t>(a + kLines * b);
      const std::span<const LineCrossing> line{inside.data() + inside_begin[n],
                                               inside.data() + inside_begin[n + 1]};
      const int low = start + change_between(along_x, begin.x(), first.x() + a * kStep) +
                      change_between(row, begin.y(), first.y() + b * kStep) -
                      change_between(line, voxel.k, begin.z());
      const bool overlap = walk(line, voxel.k, voxel.k + 1, low, [&](double from, double to) {
        sum.fill += (to - from) / (kLines * kLines);
        const Weights low_tail = lagrange_tails(from - voxel.k), high_tail = lagrange_tails(to - voxel.k);
        for (std::size_t l = 0; l < kMomentPoints; ++l)
          for (std::size_t i = 0; i < kMomentPoints; ++i)
            plane[l][i] += strips[a][i] * (low_tail[l] - high_tail[l]);
      });
      sum.overlap |= overlap;
    }
    for (std::size_t k = 0; k < kMoments; ++k)
      sum.moments[k] += strips[b][k / kMomentPoints % kMomentPoints] *
                        plane[k / (kMomentPoints * kMomentPoints)][k % kMomentPoints];
  }
  return sum;
}

double union_volume(const PartMesh& mesh, int lines) {
  const Box box = bounding_box(mesh.world);
  double volume = 0;
  for (int axis = 0; axis < 3; ++axis) {
    check_stop();
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double u_step = box.size()[u] / lines, v_step = box.size()[v] / lines;
    if (!(u_step > 0) || !(v_step > 0)) return 0;
    const LineGrid grid{axis, box.min[u] + u_step / 2, box.min[v] + v_step / 2, u_step, v_step, lines, lines};
    double length = 0, from = 0;
    int winding = 0;
    for (const LineCrossing& crossing : cross_lines(mesh, mesh.world, grid)) {
      if (winding > 0) length += crossing.at - from;  // the sum is 0 again after the last crossing of a line
      winding += crossing.change;
      from = crossing.at;
    }
    volume += length * u_step * v_step / 3;
  }
  return volume;
}

}  // namespace flexel::voxelize
