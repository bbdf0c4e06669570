// Along a line, matter is where the running sum of crossings is above 0. Inside a voxel a line along z starts
// on the low face; the winding number there follows from that at the lowest corner, along x and then y.
#include "voxelize/classify/overlap.h"

#include <algorithm>
#include <numeric>

#include "base/stop.h"
#include "voxelize/mesh/line_crossings.h"

namespace flexel::voxelize {
namespace {

constexpr int kLines = 64;                   // across a voxel
constexpr double kTouchingCrossings = 1e-6;  // in cells

// Sum of the changes of `line` at coordinates in [low, high).
int change_between(std::span<const LineCrossing> crossings, double low, double high) {
  return std::accumulate(crossings.begin(), crossings.end(), 0, [&](int sum, const LineCrossing& crossing) {
    return sum + (crossing.at >= low && crossing.at < high ? crossing.change : 0);
  });
}

// Crossings of each line: (lines + 1) ends in the sorted list.
std::vector<std::size_t> line_begins(const std::vector<LineCrossing>& crossings, std::size_t lines) {
  std::vector<std::size_t> begin(lines + 1, 0);
  for (const LineCrossing& crossing : crossings) ++begin[crossing.line + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  return begin;
}

// Length with winding > 0 in [low, high], starting from `winding` at low.
LineFill length_inside(std::span<const LineCrossing> crossings, double low, double high, int winding) {
  LineFill length;
  double from = low;
  for (const LineCrossing& crossing : crossings) {
    if (crossing.at < low || crossing.at >= high) continue;
    if (winding > 0) length.fill += crossing.at - from;
    // Surfaces that touch may be met in either order: a winding number over no length is no overlap.
    if (winding != 0 && winding != 1 && crossing.at - from > kTouchingCrossings) length.overlap = true;
    winding += crossing.change;
    from = crossing.at;
  }
  if (winding > 0) length.fill += high - from;
  if (winding != 0 && winding != 1) length.overlap = true;
  return length;
}

}  // namespace

LineFill fill_by_lines(const VoxelRecords& voxel) {
  std::vector<std::uint32_t> triangles;
  for (const Record& record : voxel.records) triangles.push_back(record.triangle);
  const PartMesh& mesh = *voxel.mesh;
  constexpr double kStep = 1. / kLines;
  const double x = voxel.i + kStep / 2, y = voxel.j + kStep / 2, z = voxel.k;
  // Axis 1: (u, v) = (z, x). Axis 0: (u, v) = (y, z). Axis 2: (u, v) = (x, y).
  const auto edge =
      cross_lines(mesh, mesh.vertices, {1, z, static_cast<double>(voxel.i), 1, 1, 1, 1}, triangles);
  const auto face = cross_lines(mesh, mesh.vertices, {0, y, z, kStep, 1, kLines, 1}, triangles);
  const auto inside = cross_lines(mesh, mesh.vertices, {2, x, y, kStep, kStep, kLines, kLines}, triangles);
  const auto face_begin = line_begins(face, kLines), inside_begin = line_begins(inside, kLines * kLines);
  LineFill sum;
  for (int b = 0; b < kLines; ++b) {
    const int row = voxel.winding[0] + change_between(edge, voxel.j, y + b * kStep);
    const std::span<const LineCrossing> along_x{face.data() + face_begin[b], face.data() + face_begin[b + 1]};
    for (int a = 0; a < kLines; ++a) {
      const int start = row + change_between(along_x, voxel.i, x + a * kStep);
      const std::size_t line = static_cast<std::size_t>(a + kLines * b);
      const LineFill length =
          length_inside({inside.data() + inside_begin[line], inside.data() + inside_begin[line + 1]}, voxel.k,
                        voxel.k + 1, start);
      sum.fill += length.fill / (kLines * kLines);
      sum.overlap |= length.overlap;
    }
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
