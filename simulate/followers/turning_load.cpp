// All sums are over the nodes in their order: a face has few beside the body.
#include "simulate/followers/turning_load.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <map>
#include <numbers>

#include "base/math/dense.h"
#include "base/math/eigenvalues.h"

namespace flexel::simulate {
namespace {

constexpr double kOnLine = 1e-9;  // of the largest extent squared: points on a line

Mat3 spin_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// v of a skew matrix, whose product with a vector is v x it.
Vec3 spin_of_skew(const Mat3& m) {
  return {m(2, 1), m(0, 2), m(1, 0)};
}

}  // namespace

std::optional<TurningLoad> TurningLoad::make(const std::vector<LoadedPoint>& points, const Carriers& carriers,
                                             const Vec3& force, const Vec3& torque,
                                             const std::optional<Vec3>& at) {
  const std::optional<WeightedMiddle> found = weighted_middle(points);
  if (!found) return std::nullopt;
  const double total = found->total;  // no structured binding: a lambda below takes it
  const Vec3 middle = found->place;
  TurningLoad made;
  std::map<std::uint32_t, Node> nodes;
  for (std::size_t q = 0; q < points.size(); ++q) {
    const Vec3 arm = points[q].position - middle;
    const double share = points[q].weight / total;
    made.rest_ += share * arm * arm.transpose();
    carriers(q, [&](std::uint32_t node, double weight) {
      Node& sum = nodes[node];
      sum.at = node;
      sum.weight += share * weight;
      sum.arm += share * weight * arm;
    });
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> extent(made.rest_, Eigen::EigenvaluesOnly);
  if (!(extent.eigenvalues()[1] > kOnLine * extent.eigenvalues()[2])) return std::nullopt;
  for (const auto& [place, node] : nodes) made.nodes_.push_back(node);
  made.force_ = force;
  made.moment_ = torque + (at ? Vec3((*at - middle).cross(force)) : Vec3(Vec3::Zero()));
  return made;
}

TurningLoad::Frame TurningLoad::frame(const std::vector<Vec3>& displacement) const {
  Mat3 a = rest_;
  for (const Node& node : nodes_) a += displacement[node.at] * node.arm.transpose();
  const NearestRotation nearest = nearest_rotation(a);
  Frame made;
  made.turn = nearest.rotation;
  made.stretch = nearest.stretch;
  made.inverse = (made.stretch.trace() * Mat3::Identity() - made.stretch).inverse();
  made.spread = made.inverse * moment_;
  return made;
}

void TurningLoad::add_forces(const std::vector<Vec3>& displacement, double factor,
                             std::vector<Vec3>& forces) const {
  const Frame now = frame(displacement);
  for (const Node& node : nodes_)
    forces[node.at] += factor * (now.turn * (node.weight * force_ + now.spread.cross(node.arm)));
}

// With D = R^T dA: R changes by R [phi], (tr S 1 - S) phi = axis of D - D^T, and S by D - [phi] S.
void TurningLoad::add_change(const std::vector<Vec3>& displacement, double factor,
                             const std::vector<Vec3>& change, std::vector<Vec3>& forces) const {
  const Frame now = frame(displacement);
  Mat3 moved = Mat3::Zero();
  for (const Node& node : nodes_) moved += change[node.at] * node.arm.transpose();
  const Mat3 local = now.turn.transpose() * moved;
  const Vec3 spin = now.inverse * spin_of_skew(local - local.transpose());
  const Mat3 stretched = local - spin_matrix(spin) * now.stretch;
  const Vec3 spread = -now.inverse * (stretched.trace() * now.spread -
                                      0.5 * (stretched + stretched.transpose()) * now.spread);
  for (const Node& node : nodes_) {
    const Vec3 force = node.weight * force_ + now.spread.cross(node.arm);
    forces[node.at] += factor * (now.turn * (spin.cross(force) + spread.cross(node.arm)));
  }
}

// From the other end: y . df = phi . v + N : D, with phi and D as above.
void TurningLoad::add_transposed_change(const std::vector<Vec3>& displacement, double factor,
                                        const std::vector<Vec3>& change, std::vector<Vec3>& forces) const {
  const Frame now = frame(displacement);
  Vec3 spun = Vec3::Zero(), spreading = Vec3::Zero();
  for (const Node& node : nodes_) {
    const Vec3 local = now.turn.transpose() * change[node.at];
    spun += (node.weight * force_ + now.spread.cross(node.arm)).cross(local);
    spreading += node.arm.cross(local);
  }
  const Vec3 c = now.inverse * spreading;
  const Mat3 n =
      0.5 * (c * now.spread.transpose() + now.spread * c.transpose()) - c.dot(now.spread) * Mat3::Identity();
  const Mat3 product = now.stretch * n;
  const Vec3 axis = now.inverse * (spun + spin_of_skew(product - product.transpose()));
  const Mat3 by_arm = now.turn * (spin_matrix(axis) + n);
  for (const Node& node : nodes_) forces[node.at] += factor * (by_arm * node.arm);
}

// At rest R = 1, so |phi| <= 2 |J^-1| sum |Z| and |db| <= |J^-1| 2 |dS| |b| for displacements of 1.
void TurningLoad::add_row_sums(double factor, std::vector<double>& sums) const {
  const Mat3 inverse = (rest_.trace() * Mat3::Identity() - rest_).inverse();
  const Vec3 spread = inverse * moment_;
  double arms = 0;
  for (const Node& node : nodes_) arms += node.arm.norm();
  const double spin = 2 * inverse.norm() * arms;
  const double spread_change = 2 * inverse.norm() * (arms + spin * rest_.norm()) * spread.norm();
  for (const Node& node : nodes_) {
    const double force = node.weight * force_.norm() + spread.norm() * node.arm.norm();
    sums[node.at] += std::abs(factor) * (spin * force + spread_change * node.arm.norm());
  }
}

Vec3 TurningLoad::turn(const std::vector<Vec3>& displacement, const Vec3& last) const {
  const Eigen::AngleAxisd found(frame(displacement).turn);
  // a turn about the other end of the axis is the same rotation; so is a whole turn more
  const Vec3 axis = found.axis().dot(last) < 0 ? Vec3(-found.axis()) : Vec3(found.axis());
  const double angle = found.axis().dot(last) < 0 ? -found.angle() : found.angle();
  const double whole = 2 * std::numbers::pi;
  return (angle + whole * std::round((last.dot(axis) - angle) / whole)) * axis;
}

}  // namespace flexel::simulate
