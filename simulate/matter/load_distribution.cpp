// Both are sums over the points in their order.
#include "simulate/matter/load_distribution.h"

#include <Eigen/Eigenvalues>

namespace flexel::simulate {
namespace {

constexpr double kLine = 1e-9;     // of the largest moment of inertia: points on a line
constexpr double kLeftOver = 0.2;  // of a bearing load

}  // namespace

std::optional<std::vector<Vec3>> averaging_link(const std::vector<LoadedPoint>& points, const Vec3& force,
                                                const Vec3& moment, const std::optional<Vec3>& at) {
  double total = 0;
  Vec3 middle = Vec3::Zero();
  for (const LoadedPoint& point : points) {
    total += point.weight;
    middle += point.weight * point.position;
  }
  if (!(total > 0)) return std::nullopt;
  middle /= total;
  Mat3 inertia = Mat3::Zero();
  for (const LoadedPoint& point : points) {
    const Vec3 arm = point.position - middle;
    inertia += point.weight * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
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
  const double along = sum.dot(direction);
  if (!(along > 0)) return std::nullopt;
  const double scale = force.norm() / along;
  const Vec3 left = force - scale * sum;
  if (left.norm() > kLeftOver * force.norm()) return std::nullopt;
  for (std::size_t q = 0; q < points.size(); ++q)
    forces[q] = scale * forces[q] + points[q].weight / total * left;
  return forces;
}

}  // namespace flexel::simulate
