// S is made the energy's second derivative along the answers Y, so that what Y is off by enters squared.
#include "simulate/quadratic/quadratic_links.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/parallel.h"
#include "simulate/conditions/link_stability.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr int kMostSteps = 12;
constexpr double kLooser = 10;             // tolerance of the links over that of the nodes
constexpr double kLinksGoodEnough = 1e-6;  // of the forces, where rounding lets it be no less
constexpr double kServes = 0.1;            // a step that leaves more than this of b: take S anew
constexpr double kAstray = 4;              // ... and more than this: back, or give up where S was new
constexpr double kDifference = 1e-5;       // of the reach
constexpr double kMostLinkTurn = 0.7;      // rad, of a step
constexpr double kStale = 0.05;            // rad, that links turned since S was made
constexpr double kFree = 1e-10;            // of lambda + 2 mu times the reach: nothing resists

Vec3 cross(const Vec3& a, const Vec3& b) {
  return a.cross(b);
}

// The derivative of a link's motion by one of its six numbers.
class LinkDirection {
 public:
  LinkDirection(const RigidLink& link, Eigen::Index number)
      : ahead_(link), behind_(link), step_(kDifference * link.reach) {
    const Vec3 along = step_ * Vec3::Unit(number % 3);
    (number < 3 ? ahead_.translation : ahead_.turn) += number < 3 ? along : Vec3(along / link.reach);
    (number < 3 ? behind_.translation : behind_.turn) -= number < 3 ? along : Vec3(along / link.reach);
    if (link.small || number < 3) return;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 arm = Vec3::Unit(axis), rest = link.middle + arm;
      spin_ += 0.5 * cross(link.displacement(rest) - link.translation + arm, displacement(rest));
    }
  }
  // m/m, of the material point that rested at `rest`
  [[nodiscard]] Vec3 displacement(const Vec3& rest) const {
    return (ahead_.displacement(rest) - behind_.displacement(rest)) / (2 * step_);
  }
  // rad/m, of what turns with it; 0 where arms are as they are at rest
  [[nodiscard]] const Vec3& spin() const { return spin_; }

 private:
  RigidLink ahead_, behind_;
  double step_;
  Vec3 spin_ = Vec3::Zero();
};

struct Wrench {
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();  // N, N m
  void add(const Vec3& f, const Vec3& arm) {
    force += f;
    moment += arm.cross(f);
  }
  [[nodiscard]] Eigen::Matrix<double, 6, 1> over(double reach) const {
    Eigen::Matrix<double, 6, 1> made;
    made << force, moment / reach;
    return made;
  }
};

// Forces at places, and the size [N] of what they are together: their sum, and their moment about their own middle over
// `reach`, for those of a couple sum up to nothing.
class Acting {
 public:
  void add(const Vec3& force, const Vec3& at) {
    force_ += force;
    moment_ += at.cross(force);
    middle_ += force.norm() * at;
    weight_ += force.norm();
  }
  [[nodiscard]] double size(double reach) const {
    if (!(weight_ > 0)) return 0;
    return Wrench{force_, moment_ - (middle_ / weight_).cross(force_)}.over(reach).norm();
  }

 private:
  Vec3 force_ = Vec3::Zero(), moment_ = Vec3::Zero(), middle_ = Vec3::Zero();
  double weight_ = 0;
};

// Where the matter of a link is, from its middle.
Vec3 arm_of(const RigidLink& link, const Vec3& rest, const Vec3& displacement) {
  return rest - link.middle + (link.small ? Vec3(Vec3::Zero()) : Vec3(displacement - link.translation));
}

Mat3 rotation_of(const LinkedNodes& nodes, std::size_t cell) {
  return nodes.turns.empty() ? Mat3(Mat3::Identity()) : Mat3(Mat3::Identity() + nodes.turns[cell]);
}

Vec3 moved_at(const NitschePoint& point, const NodeVectors& u) {
  Vec3 moved = Vec3::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) moved += point.shape.value[n] * u[n];
  return moved;
}

NodeVectors of_cell(const QuadraticSystem& system, std::size_t cell, const std::vector<Vec3>& values) {
  NodeVectors own;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) own[n] = values[system.nodes().of_cell[cell][n]];
  return own;
}

NodeVectors local_of(const QuadraticSystem& system, const LinkedNodes& nodes, std::size_t cell) {
  return local_displacement(system.nodes(), cell, nodes.displacement,
                            nodes.turns.empty() ? Mat3(Mat3::Zero()) : nodes.turns[cell]);
}

// What a link pulls its matter with, about its middle where that is now.
Wrench pull_of(const QuadraticSystem& system, const NitscheSupport& support, const LinkedNodes& nodes,
               double share, double safety) {
  const RigidLink& link = *support.tie->motion.link;
  Wrench sum;
  for (const FacePoint& at : support.points) {
    NitschePoint point = system.point(support, at, safety, share);
    point.free *= share;
    const NodeVectors u = of_cell(system, at.cell, nodes.displacement);
    sum.add(reaction(point, u, local_of(system, nodes, at.cell), rotation_of(nodes, at.cell)),
            arm_of(link, at.position, moved_at(point, u)));
  }
  for (const std::uint32_t n : support.nodes)
    sum.add(-nodes.unbalanced[n], arm_of(link, system.nodes().rest[n], nodes.displacement[n]));
  return sum;
}

// (nodes x 3) N/m: what leading the faces of a link along `direction` asks for.
std::vector<Vec3> asked_for(const QuadraticSystem& system, const NitscheSupport& support,
                            const LinkedNodes& nodes, double safety, const LinkDirection& direction) {
  std::vector<Vec3> sum(system.nodes().size(), Vec3::Zero());
  for (const FacePoint& at : support.points) {
    NitschePoint point = system.point(support, at, safety);
    point.led = direction.displacement(at.position);
    NodeVectors forces;
    forces.fill(Vec3::Zero());
    add_led(point, rotation_of(nodes, at.cell), forces);
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) sum[system.nodes().of_cell[at.cell][n]] += forces[n];
  }
  return sum;
}

// Force and moment of a link's load about its middle where that is now.
Wrench load_of(const RigidLink& link, double share) {
  const Vec3 arm = arm_of(link, link.at, link.displacement(link.at));
  const Vec3 force = link.now(link.force);
  return {share * force, share * (link.now(link.torque) + arm.cross(force))};
}

}  // namespace

void LinkBalance::take_small(bool small) const {
  for (const NitscheSupport* support : system_.linked()) support->tie->motion.link->small = small;
}

Eigen::VectorXd LinkBalance::motions() const {
  Eigen::VectorXd q(static_cast<Eigen::Index>(6 * system_.linked().size()));
  Eigen::Index at = 0;
  for (const NitscheSupport* support : system_.linked()) {
    const RigidLink& link = *support->tie->motion.link;
    q.segment<3>(at) = link.translation;
    q.segment<3>(at + 3) = link.turn * link.reach;
    at += 6;
  }
  return q;
}

void LinkBalance::set_motions(const Eigen::VectorXd& q) const {
  Eigen::Index at = 0;
  for (const NitscheSupport* support : system_.linked()) {
    RigidLink& link = *support->tie->motion.link;
    link.translation = q.segment<3>(at);
    link.turn = q.segment<3>(at + 3) / link.reach;
    at += 6;
  }
}

Eigen::VectorXd LinkBalance::lacking(const LinkedNodes& nodes, double share, double safety) const {
  Eigen::VectorXd b = motions();
  for (std::size_t l = 0; l < system_.linked().size(); ++l) {
    const NitscheSupport& support = *system_.linked()[l];
    const RigidLink& link = *support.tie->motion.link;
    b.segment<6>(static_cast<Eigen::Index>(6 * l)) =
        load_of(link, share).over(link.reach) -
        pull_of(system_, support, nodes, share, safety).over(link.reach);
  }
  return b;
}

// N: loads and reactions, what is lacking is small beside them.
double LinkBalance::forces(const LinkedNodes& nodes, double share, double safety) const {
  double sum = 0, reach = 0;
  for (const NitscheSupport* support : system_.linked())
    reach = std::max(reach, support->tie->motion.link->reach);
  for (const NodalLoad& load : system_.loads()) {
    Acting whole;
    for (std::size_t n = 0; n < load.forces.size(); ++n) whole.add(load.forces[n], system_.nodes().rest[n]);
    sum += share * whole.size(reach);
  }
  for (const NitscheSupport& support : system_.supports()) {
    if (support.tie->link) {
      const RigidLink& link = *support.tie->motion.link;
      sum += load_of(link, share).over(link.reach).norm();
      continue;
    }
    Acting whole;
    for (const FacePoint& at : support.points)
      whole.add(
          reaction(system_.point(support, at, safety, share), of_cell(system_, at.cell, nodes.displacement),
                   local_of(system_, nodes, at.cell), rotation_of(nodes, at.cell)),
          at.position);
    for (const std::uint32_t n : support.nodes) whole.add(nodes.unbalanced[n], system_.nodes().rest[n]);
    sum += whole.size(reach);
  }
  return sum;
}

// One number's answer Y, and S's column by differences along it; `left`: what the nodes lack along it.
bool LinkBalance::add_column(LinkedNodes& nodes, double share, double safety, Eigen::Index number,
                             std::vector<Vec3>& left) {
  const std::size_t size = system_.nodes().size();
  const NitscheSupport& moving = *system_.linked()[static_cast<std::size_t>(number / 6)];
  const RigidLink& link = *moving.tie->motion.link;
  const LinkDirection direction(link, number % 6);
  const std::vector<Vec3> asked = asked_for(system_, moving, nodes, safety, direction);
  std::vector<Vec3> led(size, Vec3::Zero());
  for (const std::uint32_t n : moving.nodes) led[n] = direction.displacement(system_.nodes().rest[n]);
  left.resize(size);
  nodes.stiffness.forces(led[0].data(), left[0].data());
  parallel_for_each(size, [&](std::size_t n) { left[n] = asked[n] - left[n]; });
  nodes.stiffness.clear_held(left);
  std::vector<Vec3>& response = responses_[static_cast<std::size_t>(number)];
  if (!nodes.solve(left, response)) return false;
  for (std::size_t n = 0; n < size; ++n) response[n] += led[n];
  const Eigen::VectorXd q = motions();
  const std::vector<Vec3> u = nodes.displacement;
  // where all is linear a long step loses nothing to rounding
  const double step = (link.small ? 1 : kDifference) * link.reach;
  bool found = true;
  for (const double way : {step, -step}) {
    set_motions(q + way * Eigen::VectorXd::Unit(q.size(), number));
    for (std::size_t n = 0; n < size; ++n) nodes.displacement[n] = u[n] + way * response[n];
    found = found && nodes.evaluate();
    slope_.col(number) += lacking(nodes, share, safety) / (2 * way);
    for (std::size_t n = 0; n < size; ++n)
      left[n] =
          (way > 0 ? nodes.unbalanced[n] : Vec3(left[n] - nodes.unbalanced[n])) / (way > 0 ? 1 : 2 * step);
  }
  nodes.stiffness.clear_held(left);
  set_motions(q);
  nodes.displacement = u;
  return nodes.evaluate() && found;
}

bool LinkBalance::find_slope(LinkedNodes& nodes, double share, double safety) {
  made_at_ = motions();
  const Eigen::Index count = made_at_.size();
  Eigen::MatrixXd& slope = slope_ = Eigen::MatrixXd::Zero(count, count);
  responses_.assign(static_cast<std::size_t>(count), {});
  std::vector<std::vector<Vec3>> left(responses_.size());
  nodes.make_tangent();
  for (Eigen::Index j = 0; j < count; ++j)
    if (!add_column(nodes, share, safety, j, left[static_cast<std::size_t>(j)])) {
      slope_.resize(0, 0);
      return false;
    }
  // the energy's second derivative along the answers: what their solutions left enters squared then
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j)
      slope(i, j) += dot(responses_[static_cast<std::size_t>(i)], left[static_cast<std::size_t>(j)]);
  return true;
}

// rad, the largest of all links
double LinkBalance::turn_of(const Eigen::VectorXd& step) const {
  double most = 0;
  for (std::size_t l = 0; l < system_.linked().size(); ++l)
    most = std::max(most, step.segment<3>(static_cast<Eigen::Index>(6 * l + 3)).norm() /
                              system_.linked()[l]->tie->motion.link->reach);
  return most;
}

void LinkBalance::refuse_free() const {
  const SingularValues svd = singular_values(slope_);
  double stiffest = 0;  // of what deforms: the material of rigid parts means nothing here
  for (const NitscheSupport* support : system_.linked())
    for (std::size_t c = 0; c < system_.nodes().cells.size(); ++c)
      if (!system_.is_rigid(c))
        stiffest = std::max(stiffest, system_.stiffest(c) * support->tie->motion.link->reach);
  if (svd.values.minCoeff() > kFree * stiffest) return;
  Eigen::Index most = 0;
  svd.v.col(slope_.cols() - 1).cwiseAbs().maxCoeff(&most);
  const RigidLink& link = *system_.linked()[static_cast<std::size_t>(most / 6)]->tie->motion.link;
  throw InputError(
      link.origin,
      fmt::format("\"{}\": nothing holds what moves as a rigid body here, which is free to {} {}: "
                  "add a [[fix]] that stops it",
                  link.name, most % 6 < 3 ? "translate along" : "rotate about", "xyz"[most % 3]));
}

bool LinkBalance::find(LinkedNodes& nodes, double share, double safety, double tolerance) {
  if (!any() || balance(nodes, share, safety, tolerance)) return true;
  slope_.resize(0, 0);  // the next attempt starts elsewhere
  return false;
}

void LinkBalance::go(LinkedNodes& nodes, const Eigen::VectorXd& step) const {
  set_motions(motions() + step);
  for (Eigen::Index j = 0; j < step.size(); ++j) {
    const std::vector<Vec3>& response = responses_[static_cast<std::size_t>(j)];
    parallel_for_each(response.size(),
                      [&](std::size_t n) { nodes.displacement[n] += step[j] * response[n]; });
  }
}

bool LinkBalance::balance(LinkedNodes& nodes, double share, double safety, double tolerance) {
  Eigen::VectorXd left = lacking(nodes, share, safety);
  double scale = forces(nodes, share, safety);
  const double asked = kLooser * tolerance;
  bool serves = slope_.size() > 0 && turn_of(motions() - made_at_) < kStale;
  bool made = false;  // S, in this call
  for (int k = 0; k < kMostSteps && left.norm() > asked * scale; ++k) {
    if (!serves) {
      if (!find_slope(nodes, share, safety)) return false;
      refuse_free();
      made = true;
    }
    Eigen::VectorXd step = -solve_dense(slope_, left);
    if (const double turn = turn_of(step); !nodes.turns.empty() && turn > kMostLinkTurn)
      step *= kMostLinkTurn / turn;
    const Eigen::VectorXd q = motions();
    const std::vector<Vec3> u = nodes.displacement;
    go(nodes, step);
    const bool held = nodes.hold();
    const Eigen::VectorXd now = held ? lacking(nodes, share, safety) : left;
    const double scale_now = held ? forces(nodes, share, safety) : scale;
    const bool good_enough = held && now.norm() <= kLinksGoodEnough * scale_now;
    if (!held || !(now.norm() < kAstray * left.norm())) {
      if (made || good_enough) return good_enough;
      // S of another load step led astray: back, and take it anew
      set_motions(q);
      nodes.displacement = u;
      if (!nodes.evaluate()) return false;
      serves = false;
      continue;
    }
    if (now.norm() > 0.5 * left.norm() && good_enough) return true;
    serves = now.norm() < kServes * left.norm();
    slope_ += (now - left - slope_ * step) * step.transpose() / step.squaredNorm();
    left = now;
    scale = scale_now;
  }
  return left.norm() <= asked * scale;
}

std::optional<bool> LinkBalance::stable(LinkedNodes& nodes, double share, double safety) {
  if (!find_slope(nodes, share, safety)) return std::nullopt;
  std::vector<const RigidLink*> links;
  for (const auto& linked : system_.linked()) links.push_back(linked->tie->motion.link.get());
  return link_motions_are_stable(slope_, links);
}

}  // namespace flexel::simulate
