// The small fixed-size types that every stage uses, all double precision, all SI (metres) unless a name says
// otherwise.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace flexel {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Index3 = std::array<std::int32_t, 3>;

// Axis-aligned box. Empty (min > max) until something is added.
struct Box {
  Vec3 min = Vec3::Constant(1e300);
  Vec3 max = Vec3::Constant(-1e300);
  void add(const Vec3& point) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  [[nodiscard]] bool empty() const { return (min.array() > max.array()).any(); }
  [[nodiscard]] Vec3 size() const { return empty() ? Vec3(Vec3::Zero()) : Vec3(max - min); }
  [[nodiscard]] double diagonal() const { return size().norm(); }
};

[[nodiscard]] inline Box bounding_box(const std::vector<Vec3>& points) {
  Box box;
  for (const Vec3& point : points) box.add(point);
  return box;
}

}  // namespace flexel
