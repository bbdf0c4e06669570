// Poses and momenta of rigid parts.
#include "simulate/rigid/rigid_body.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/math/small_matrices.h"

namespace flexel::simulate {
namespace {

constexpr double kLargestTurn = 0.5;  // rad, in one go
constexpr double kRounding = 1e-16;   // share of the angular momentum
constexpr int kMostRounds = 60;
constexpr double kMostPieces = 1e4;  // of a step, of that turn

Mat3 inertia_of(const Mat3& second) {
  return second.trace() * Mat3::Identity() - second;
}

// dt w of the header [rad], in the frame of the part. The iteration contracts by half the turn.
Vec3 turn_in(const RigidBody& rigid, const Mat3& rotation, const Vec3& momentum, double step) {
  const Vec3 spin = rotation.transpose() * momentum;
  Vec3 middle = spin, velocity = rigid.inverse_inertia * spin;
  for (int i = 0; i < kMostRounds; ++i) {
    const double half = 0.5 * step * velocity.norm();
    const Vec3 next = spin + 0.5 * step * (half > 0 ? std::tan(half) / half : 1) * middle.cross(velocity);
    const double change = (next - middle).norm();
    middle = next;
    velocity = rigid.inverse_inertia * middle;
    if (!(change > kRounding * spin.norm())) break;
  }
  return step * velocity;
}

}  // namespace

// Rodrigues, by half angles: sin(a) / a [a] + 2 sin^2(a / 2) / a^2 [a]^2.
Mat3 change_by(const Vec3& turn) {
  const double angle = turn.norm();
  const Mat3 cross = cross_matrix(turn);
  if (angle < 1e-150) return cross;
  const double half = std::sin(0.5 * angle) / angle;
  return std::sin(angle) / angle * cross + 2 * half * half * cross * cross;
}

Mat3 turned_by(const Vec3& turn) {
  return Mat3::Identity() + change_by(turn);
}

Vec3 turn_of(const Mat3& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

RigidBody rigid_body(const Body& body, std::uint32_t part, const MassMoments& matter) {
  RigidBody made;
  made.part = part;
  made.begin = body.parts[part].element_begin;
  made.end = body.parts[part].element_end;
  made.mass = matter.mass;
  made.centre = matter.centre;
  made.inertia = inertia_of(matter.second);
  for (std::uint32_t e = made.begin; e < made.end; ++e) made.arms.push_back(body.rest[e] - made.centre);
  made.inverse_inertia = inverse_on_range(made.inertia).first;
  return made;
}

// The rotation that fits best: Kabsch 1976.
void take_up(RigidBody& rigid, const Body& body, const std::vector<double>& mass,
             const std::vector<Vec3>& displacement, const std::vector<Vec3>& velocity) {
  double whole = 0;
  Vec3 at = Vec3::Zero(), at_rest = Vec3::Zero(), speed = Vec3::Zero();
  for (std::uint32_t e = rigid.begin; e < rigid.end; ++e) {
    whole += mass[e];
    at += mass[e] * (body.rest[e] + displacement[e]);
    at_rest += mass[e] * rigid.arms[e - rigid.begin];
    speed += mass[e] * velocity[e];
  }
  at /= whole, at_rest /= whole, speed /= whole;
  Mat3 moment = Mat3::Zero(), second = Mat3::Zero();
  Vec3 spin = Vec3::Zero();
  bool turned = false;
  for (std::uint32_t e = rigid.begin; e < rigid.end; ++e) {
    const Vec3 now = body.rest[e] + displacement[e] - at;
    moment += mass[e] * now * (rigid.arms[e - rigid.begin] - at_rest).transpose();
    second += mass[e] * now * now.transpose();
    turned = turned || displacement[e] != displacement[rigid.begin];
    spin += mass[e] * now.cross(velocity[e] - speed);
  }
  Mat3 rotation = Mat3::Identity();
  if (turned) rotation = nearest_rotation(moment).rotation;
  const Vec3 centre = at - rotation * at_rest;
  rigid.pose = {centre - rigid.centre, rotation};
  // about an axis that all elements lie on nothing is known to turn
  const Vec3 turning = inverse_on_range(inertia_of(second)).first * spin;
  rigid.momentum = rigid.mass * (speed - turning.cross(rotation * at_rest));
  rigid.spin = rotation * rigid.inertia * rotation.transpose() * turning;
}

Vec3 angular_velocity(const RigidBody& rigid, const Mat3& rotation, const Vec3& spin) {
  return rotation * rigid.inverse_inertia * rotation.transpose() * spin;
}

Pose drifted(const RigidBody& rigid, const Vec3& momentum, const Vec3& spin, double step) {
  Pose next{rigid.pose.translation + step / rigid.mass * momentum, rigid.pose.rotation};
  const double fastest = rigid.inverse_inertia.norm() * spin.norm();  // rad/s
  const double pieces = std::ceil(std::max(step * fastest / kLargestTurn, 1.0));
  if (!(pieces <= kMostPieces))
    throw DivergedError(fmt::format(
        "a rigid part spins at {:.3g} rad/s, {:.3g} turns in a step of {:.3g} s: a shorter [run] step, "
        "or a slower spin",
        fastest, step * fastest / (2 * std::numbers::pi), step));
  for (double piece = 0; piece < pieces; ++piece)
    next.rotation = next.rotation * turned_by(turn_in(rigid, next.rotation, spin, step / pieces));
  return next;
}

RigidMomenta momenta_at(const RigidBody& rigid, const Pose& at, const Vec3& momentum_before,
                        const Vec3& spin_before) {
  const Vec3 momentum = 0.5 * (momentum_before + rigid.momentum);
  const Vec3 centre = rigid.centre + at.translation;
  return {rigid.begin, rigid.end,
          0.5 * (momentum_before.dot(rigid.momentum) / rigid.mass +
                 spin_before.dot(angular_velocity(rigid, at.rotation, rigid.spin))),
          momentum, centre.cross(momentum) + 0.5 * (spin_before + rigid.spin)};
}

void move_to(RigidBody& rigid, const Pose& next, double step, std::vector<Vec3>& displacement,
             std::vector<Vec3>& velocity) {
  const Vec3 moved = next.translation - rigid.pose.translation;
  const Mat3 change = next.rotation - rigid.pose.rotation;
  const Vec3 spin = angular_velocity(rigid, next.rotation, rigid.spin);
  const Mat3 turned = next.rotation - Mat3::Identity();
  for (std::uint32_t e = rigid.begin; e < rigid.end; ++e) {
    const Vec3& arm = rigid.arms[e - rigid.begin];
    displacement[e] = next.translation + turned * arm;
    velocity[e] = step > 0 ? Vec3((moved + change * arm) / step)
                           : Vec3(rigid.momentum / rigid.mass + spin.cross(next.rotation * arm));
  }
  // rounding would let it shear over many steps
  rigid.pose = {next.translation, Eigen::Quaterniond(next.rotation).normalized().toRotationMatrix()};
}

}  // namespace flexel::simulate
