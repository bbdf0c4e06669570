// Polygons cut by the planes of a lattice.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

using Outline = std::vector<Vec3>;  // of a convex polygon, lattice coordinates

[[nodiscard]] inline Vec3 middle_of(const Outline& outline) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& corner : outline) sum += corner;
  return sum / static_cast<double>(outline.size());
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
    Outline piece = outline;
    for (const double side : {1.0, -1.0}) {  // above the lower plane, below the upper one
      const double at = side > 0 ? plane : plane + 1;
      Outline kept;
      for (std::size_t v = 0; v < piece.size(); ++v) {
        const Vec3 &a = piece[v], &b = piece[(v + 1) % piece.size()];
        const double da = side * (a[axis] - at), db = side * (b[axis] - at);
        if (da >= 0) kept.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
      }
      piece = std::move(kept);
    }
    if (piece.size() >= 3) for_each_voxel(piece, axis + 1, visit);
  }
}

}  // namespace flexel::simulate
