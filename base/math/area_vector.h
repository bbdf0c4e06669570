// Area vectors of polygons: area times unit normal, m^2.
#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/math/vec.h"

namespace flexel {

// Of a polygon of n corners, at(i) the position of corner i; of one that is not flat, the sum over its
// triangles, the same for every way to cut it into them.
template <class At>
[[nodiscard]] Vec3 area_vector(std::size_t n, const At& at) {
  Vec3 sum = Vec3::Zero();
  const Vec3& origin = at(0);
  for (std::size_t i = 1; i + 1 < n; ++i) sum += 0.5 * (at(i) - origin).cross(at(i + 1) - origin);
  return sum;
}

// corners: indices into `vertices`.
[[nodiscard]] inline Vec3 area_vector(const std::vector<Vec3>& vertices,
                                      std::span<const std::uint32_t> corners) {
  return area_vector(corners.size(), [&](std::size_t i) -> const Vec3& { return vertices[corners[i]]; });
}

}  // namespace flexel
