// Polygons cut by the planes of a lattice.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

using Outline = std::vector<Vec3>;  // of a convex polygon, lattice coordinates

[[nodiscard]] inline Vec3 middle_of(const Outline& outline) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& corner : outline) sum += corner;
  return sum / static_cast<double>(outline.size());
}

// Voxels, from lower to upper in lattice coordinates.
struct VoxelRange {
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();
  [[nodiscard]] bool contains(const Vec3& at) const {
    return (at.array() >= lower.array()).all() && (at.array() <= upper.array()).all();
  }
};

// Voxels of a lattice with lower <= index < upper.
struct LatticeBox {
  Lattice lattice;
  Index3 lower{}, upper{};
};

// The part of a polygon above (side 1) or below (-1) the plane x[axis] = at; fewer than three corners: there is none.
[[nodiscard]] inline Outline beside_plane(const Outline& outline, int axis, double at, double side) {
  Outline kept;
  for (std::size_t v = 0; v < outline.size(); ++v) {
    const Vec3 &a = outline[v], &b = outline[(v + 1) % outline.size()];
    const double da = side * (a[axis] - at), db = side * (b[axis] - at);
    if (da >= 0) kept.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

// With what lies on the faces of the range, but for rounding.
[[nodiscard]] inline Outline in_range(Outline outline, const VoxelRange& range) {
  constexpr double kOnFace = 1e-6;  // spacings
  for (int axis = 0; axis < 3; ++axis) {
    outline = beside_plane(outline, axis, range.lower[axis] - kOnFace, 1);
    outline = beside_plane(outline, axis, range.upper[axis] + kOnFace, -1);
  }
  return outline;
}

// Calls visit(piece) for the part of a polygon in each voxel; from axis 0 on, axis by axis.
template <class Visit>
void for_each_voxel(const Outline& outline, int axis, const Visit& visit) {
  if (axis == 3) return visit(outline);
  double low = outline[0][axis], high = low;
  for (const Vec3& corner : outline) {
    low = std::min(low, corner[axis]);
    high = std::max(high, corner[axis]);
  }
  const double first = std::floor(low), last = std::max(first, std::ceil(high) - 1);
  for (double plane = first; plane <= last; ++plane) {
    const Outline piece = beside_plane(beside_plane(outline, axis, plane, 1), axis, plane + 1, -1);
    if (piece.size() >= 3) for_each_voxel(piece, axis + 1, visit);
  }
}

}  // namespace flexel::simulate
