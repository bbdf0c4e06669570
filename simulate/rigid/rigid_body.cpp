// Poses and momenta of rigid parts.
#include "simulate/rigid/rigid_body.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "base/math/small_matrices.h"

namespace flexel::simulate {
namespace {

Vec3 angular_velocity(const RigidBody& rigid, const Mat3& rotation) {
  return rotation * rigid.inverse_inertia * rotation.transpose() * rigid.spin;
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

RigidBody rigid_body(const Body& body, std::uint32_t part, const std::vector<double>& mass) {
  RigidBody made;
  made.part = part;
  made.begin = body.parts[part].element_begin;
  made.end = body.parts[part].element_end;
  for (std::uint32_t e = made.begin; e < made.end; ++e) {
    made.mass += mass[e];
    made.centre += mass[e] * body.rest[e];
  }
  made.centre /= made.mass;
  made.inertia = Mat3::Zero();
  for (std::uint32_t e = made.begin; e < made.end; ++e) {
    const Vec3 arm = body.rest[e] - made.centre;
    made.arms.push_back(arm);
    made.inertia += mass[e] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  // About an axis that all elements lie on nothing turns.
  made.inverse_inertia = inverse_on_range(made.inertia).first;
  return made;
}

// The rotation that fits best: Kabsch 1976.
void take_up(RigidBody& rigid, const Body& body, const std::vector<double>& mass,
             const std::vector<Vec3>& displacement, const std::vector<Vec3>& velocity) {
  Vec3 centre = Vec3::Zero();
  rigid.momentum = rigid.spin = Vec3::Zero();
  for (std::uint32_t e = rigid.begin; e < rigid.end; ++e) {
    centre += mass[e] / rigid.mass * (body.rest[e] + displacement[e]);
    rigid.momentum += mass[e] * velocity[e];
  }
  Mat3 moment = Mat3::Zero();
  bool turned = false;
  for (std::uint32_t e = rigid.begin; e < rigid.end; ++e) {
    const Vec3 now = body.rest[e] + displacement[e] - centre;
    moment += mass[e] * now * rigid.arms[e - rigid.begin].transpose();
    turned = turned || displacement[e] != displacement[rigid.begin];
    rigid.spin += mass[e] * now.cross(velocity[e]);
  }
  rigid.pose = {centre - rigid.centre, Mat3::Identity()};
  if (!turned) return;
  const Eigen::JacobiSVD<Mat3> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 signs = Mat3::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs(2, 2) = -1;
  rigid.pose.rotation = svd.matrixU() * signs * svd.matrixV().transpose();
}

Pose drifted(const RigidBody& rigid, double step) {
  const Mat3 middle =
      turned_by(0.5 * step * angular_velocity(rigid, rigid.pose.rotation)) * rigid.pose.rotation;
  return {rigid.pose.translation + step / rigid.mass * rigid.momentum,
          turned_by(step * angular_velocity(rigid, middle)) * rigid.pose.rotation};
}

void move_to(RigidBody& rigid, const Pose& next, double step, std::vector<Vec3>& displacement,
             std::vector<Vec3>& velocity) {
  const Vec3 moved = next.translation - rigid.pose.translation;
  const Mat3 change = next.rotation - rigid.pose.rotation;
  const Vec3 spin = angular_velocity(rigid, next.rotation);
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
