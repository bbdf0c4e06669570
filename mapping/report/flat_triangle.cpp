// Points along the edges of a triangle, and inside it, are mapped and their distance from the plane of the
// mapped corners is taken; sliding within the plane does not change the shape. A sharp edge belongs to
// triangles in two planes, so bending in either direction is seen. What lies across an unshared edge may be split where
// this triangle is not, and has other corners there: whatever such an edge misses is a gap.
#include "mapping/report/flat_triangle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace flexel::mapping {
namespace {

constexpr double kMostOnEdge = 16;  // pairs of pieces, each of two spacings or more
constexpr double kMostInside = 3;   // thirds of a triangle's sides, each in as many pieces

// Even, so that the middle is among the points.
int pieces_of_edge(double spacings) {
  return 2 * static_cast<int>(std::clamp(std::ceil(spacings / (2 * kLongEdge)), 1.0, kMostOnEdge));
}
// Divisible by three, so that the centroid is.
int pieces_inside(double spacings) {
  return 3 * static_cast<int>(std::clamp(std::ceil(spacings / (3 * kLongEdge)), 1.0, kMostInside));
}

double distance_from_line(const Vec3& p, const Vec3& from, const Vec3& to) {
  const Vec3 along = (to - from).normalized();
  return (p - from).cross(along).norm();
}

}  // namespace

MissedPoint FlatTriangles::operator()(const FlatTriangle& triangle) {
  MissedPoint found;
  const double spacing = body_.parts[triangle.part].lattice.spacing.minCoeff();
  const std::array<Vec3, 3>& rest = triangle.corners;
  std::array<Vec3, 3> moved;
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    longest = std::max(longest, (rest.at((i + 1) % 3) - rest.at(i)).norm());
    moved.at(i) = probe_.place(rest.at(i), triangle.part, triangle.polygon).position;
  }
  const Vec3 area = (moved[1] - moved[0]).cross(moved[2] - moved[0]);
  if (!(area.norm() > 0) || !area.allFinite()) return found;
  const Vec3 normal = area.normalized();
  const Vec3 middle = (rest[0] + rest[1] + rest[2]) / 3;
  // An area vector goes with the inverse transpose of the gradient F, times its determinant.
  const Mat3& f = probe_.at(middle, triangle.part, triangle.polygon).gradient;
  Mat3 cofactors;
  cofactors << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  const Vec3 turned = cofactors * (rest[1] - rest[0]).cross(rest[2] - rest[0]);
  if (turned.norm() > 0) found.facing = normal.dot(turned.normalized());
  const auto look = [&](double u, double v, const Vec3* from = nullptr, const Vec3* to = nullptr) {
    const Vec3 x = rest[0] + u * (rest[1] - rest[0]) + v * (rest[2] - rest[0]);
    const SpaceMap::Value value = probe_.place(x, triangle.part, triangle.polygon);
    if (!value.in_radius || !value.position.allFinite()) return;
    found.displacement = std::max(found.displacement, (value.position - x).norm());
    const double distance = from != nullptr ? distance_from_line(value.position, *from, *to)
                                            : std::abs(normal.dot(value.position - moved[0]));
    if (distance <= found.largest) return;
    found.largest = distance;
    found.at = x;
  };
  const std::array<std::array<double, 2>, 3> corner = {{{0, 0}, {1, 0}, {0, 1}}};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto &from = corner.at(i), &to = corner.at((i + 1) % 3);
    const double length = (rest.at((i + 1) % 3) - rest.at(i)).norm() / spacing;
    if (!(length > kLongEdge)) continue;
    const int n = pieces_of_edge(length);
    const bool alone = triangle.unshared >> i & 1;
    const Vec3 *begin = alone ? &moved.at(i) : nullptr, *end = alone ? &moved.at((i + 1) % 3) : nullptr;
    for (int k = 1; k < n; ++k) {
      const double s = static_cast<double>(k) / n;
      look(from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]), begin, end);
    }
  }
  const double height = (rest[1] - rest[0]).cross(rest[2] - rest[0]).norm() / longest;
  if (!(height > kLongEdge * spacing)) return found;
  const int n = pieces_inside(longest / spacing);
  for (int i = 1; i < n - 1; ++i)
    for (int j = 1; i + j < n; ++j) look(static_cast<double>(i) / n, static_cast<double>(j) / n);
  return found;
}

}  // namespace flexel::mapping
