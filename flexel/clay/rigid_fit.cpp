// The rotation is the one nearest to the covariance of where points are and where they were (Kabsch 1976).
#include "flexel/clay/rigid_fit.h"

#include <Eigen/Geometry>

#include "base/math/dense.h"

namespace flexel::clay {

Vec3 mean_rest(const std::vector<MovedPoint>& points) {
  Vec3 sum = Vec3::Zero();
  for (const MovedPoint& point : points) sum += point.rest;
  return points.empty() ? sum : Vec3(sum / static_cast<double>(points.size()));
}

ToolPose rigid_fit(const std::vector<MovedPoint>& points) {
  ToolPose pose;
  if (points.empty()) return pose;
  const Vec3 middle = mean_rest(points);
  for (const MovedPoint& point : points) pose.displacement += point.displacement;
  pose.displacement /= static_cast<double>(points.size());
  Mat3 covariance = Mat3::Zero();
  bool moved = false;
  for (const MovedPoint& point : points) {
    const Vec3 arm = point.rest - middle;
    const Vec3 bent = point.displacement - pose.displacement;
    moved = moved || bent.squaredNorm() > 1e-24 * arm.squaredNorm();
    covariance += (arm + bent) * arm.transpose();
  }
  if (!moved) return pose;
  const NearestRotation nearest = nearest_rotation(covariance);
  if (!(nearest.values[1] > 1e-9 * nearest.values[0])) return pose;
  const Eigen::AngleAxisd turn(nearest.rotation);
  pose.turn = turn.angle() * turn.axis();
  return pose;
}

}  // namespace flexel::clay
