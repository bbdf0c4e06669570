// By points that move (base/math/rigid_fit.h).
#include "flexel/clay/rigid_fit.h"

#include <Eigen/Geometry>

#include "base/math/rigid_fit.h"

namespace flexel::clay {

Vec3 mean_rest(const std::vector<MovedPoint>& points) {
  Vec3 sum = Vec3::Zero();
  for (const MovedPoint& point : points) sum += point.rest;
  return points.empty() ? sum : Vec3(sum / static_cast<double>(points.size()));
}

ToolPose rigid_fit(const std::vector<MovedPoint>& points) {
  std::vector<Vec3> rest, displacement;
  for (const MovedPoint& point : points) {
    rest.push_back(point.rest);
    displacement.push_back(point.displacement);
  }
  const RigidFit fit = flexel::rigid_fit(rest, displacement);
  const Eigen::AngleAxisd turn(fit.rotation);
  return {fit.displacement, turn.angle() * turn.axis()};
}

}  // namespace flexel::clay
