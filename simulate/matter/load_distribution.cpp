// Both are sums over the points in their order.
#include "simulate/matter/load_distribution.h"

#include <Eigen/Geometry>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"
#include "formats/pieces/other_pieces.h"

namespace flexel::simulate {
namespace {

constexpr double kLine = 1e-9;     // of the largest moment of inertia: points on a line
constexpr double kLeftOver = 0.2;  // of a bearing load

}  // namespace

std::optional<WeightedMiddle> weighted_middle(const std::vector<LoadedPoint>& points) {
  WeightedMiddle middle;
  for (const LoadedPoint& point : points) {
    middle.total += point.weight;
    middle.place += point.weight * point.position;
  }
  middle.total = over_pieces(middle.total);
  if (!(middle.total > 0)) return std::nullopt;
  middle.place = over_pieces(middle.place) / middle.total;
  return middle;
}

std::optional<std::vector<Vec3>> averaging_link(const std::vector<LoadedPoint>& points, const Vec3& force,
                                                const Vec3& moment, const std::optional<Vec3>& at) {
  const std::optional<WeightedMiddle> found = weighted_middle(points);
  if (!found) return std::nullopt;
  const auto& [total, middle] = *found;
  Mat3 inertia = Mat3::Zero();
  for (const LoadedPoint& point : points) {
    const Vec3 arm = point.position - middle;
    inertia += point.weight * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  inertia = over_pieces(inertia);
  const Vec3 wanted = moment + (at ? Vec3((*at - middle).cross(force)) : Vec3(Vec3::Zero()));
  Vec3 turn = Vec3::Zero();
  if (wanted != Vec3::Zero()) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(inertia);
    for (int i = 0; i < 3; ++i) {
      const Vec3 axis = eigen.eigenvectors().col(i);
      const double about = axis.dot(wanted);
      if (eigen.eigenvalues()[i] > kLine * eigen.eigenvalues()[2])
        turn += about / eigen.eigenvalues()[i] * axis;
      else if (std::abs(about) > kLine * wanted.norm())
        return std::nullopt;
    }
  }
  std::vector<Vec3> forces;
  forces.reserve(points.size());
  for (const LoadedPoint& point : points)
    forces.push_back(point.weight * (force / total + turn.cross(point.position - middle)));
  return forces;
}

std::optional<std::vector<Vec3>> bearing(const std::vector<LoadedPoint>& points, const Vec3& force) {
  std::vector<Vec3> forces;
  forces.reserve(points.size());
  const Vec3 direction = force.normalized();
  Vec3 sum = Vec3::Zero();
  double total = 0;
  for (const LoadedPoint& point : points) {
    const double against = std::max(0.0, -point.normal.dot(direction));
    forces.push_back(-point.weight * against * point.normal);
    sum += forces.back();
    total += point.weight;
  }
  sum = over_pieces(sum);
  total = over_pieces(total);
  const double along = sum.dot(direction);
  if (!(along > 0)) return std::nullopt;
  const double scale = force.norm() / along;
  const Vec3 left = force - scale * sum;
  if (left.norm() > kLeftOver * force.norm()) return std::nullopt;
  for (std::size_t q = 0; q < points.size(); ++q)
    forces[q] = scale * forces[q] + points[q].weight / total * left;
  return forces;
}

std::optional<Vec3> turn_of_couple(std::size_t count, const std::function<LoadedMotion(std::size_t)>& at) {
  constexpr double kCouple = 1e-3;  // of forces times arms: less moment about their middle is rounding
  double whole = 0, arms = 0;
  Vec3 middle = Vec3::Zero(), moved = Vec3::Zero(), moment = Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const LoadedMotion each = at(i);
    const double weight = each.force.norm();
    whole += weight;
    middle += weight * each.rest;
    moved += weight * each.displacement;
  }
  whole = over_pieces(whole);
  middle = over_pieces(middle) / whole;
  moved = over_pieces(moved) / whole;
  Mat3 product = Mat3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const LoadedMotion each = at(i);
    const Vec3 arm = each.rest - middle;
    product += each.force.norm() * (arm + each.displacement - moved) * arm.transpose();
    moment += arm.cross(each.force);
    arms += arm.norm() * each.force.norm();
  }
  product = over_pieces(product);
  moment = over_pieces(moment);
  arms = over_pieces(arms);
  if (!(moment.norm() > kCouple * arms)) return std::nullopt;
  const NearestRotation nearest = nearest_rotation(product);
  if (!(nearest.values[1] > 1e-9 * nearest.values[0])) return std::nullopt;  // a line
  const Eigen::AngleAxisd turn(nearest.rotation);
  return Vec3(turn.angle() * turn.axis());
}

}  // namespace flexel::simulate
