// A part that does not deform: six degrees of freedom.
//
// Its elements keep their places in it. Forces act on the elements as on any others; after a step the
// impulses that they took are summed up to that on the whole, and the elements are put where the part has
// gone. Mass and inertia are those of the elements, the same that the books count: a box n cells thick has 2
// / n^2 more inertia than its matter evenly spread.
//     X+ = X + dt P / m,    R+ = exp(dt omega) R,   omega = R J^-1 R^T L at the middle of the step
// (P, L momentum and angular momentum about the centre of mass, kicked before; J at rest), second order in
// the step; P and L are kept to rounding.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

struct Pose {
  Vec3 translation = Vec3::Zero();   // m, of the centre of mass, from rest
  Mat3 rotation = Mat3::Identity();  // about it, from rest
};

// Rotation by the vector `turn` [rad], and the same less the identity, without cancellation.
[[nodiscard]] Mat3 turned_by(const Vec3& turn);
[[nodiscard]] Mat3 change_by(const Vec3& turn);
// The vector [rad], of at most pi, of a rotation.
[[nodiscard]] Vec3 turn_of(const Mat3& rotation);

struct RigidBody {
  std::uint32_t part = 0, begin = 0, end = 0;  // range of elements
  double mass = 0;                             // kg
  Vec3 centre = Vec3::Zero();                  // m, of mass, at rest
  Mat3 inertia = Mat3::Identity();             // kg m^2, about it, at rest
  Mat3 inverse_inertia = Mat3::Identity();
  std::vector<Vec3> arms;  // (its elements) m, from the centre, at rest
  // state
  Pose pose;
  Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero();  // kg m/s, kg m^2/s: P, L
};

// Of elements [begin, end). A part in a line or a point gets no inertia about it (its inverse is 0 there).
[[nodiscard]] RigidBody rigid_body(const Body& body, std::uint32_t part, const std::vector<double>& mass);

// Fits pose and momenta to where its elements are and how they move.
void take_up(RigidBody& rigid, const Body& body, const std::vector<double>& mass,
             const std::vector<Vec3>& displacement, const std::vector<Vec3>& velocity);

// The pose after `step` s with the present momenta.
[[nodiscard]] Pose drifted(const RigidBody& rigid, double step);

// Puts displacements [m] and velocities [m/s] of its elements where it goes from `rigid.pose` to `next` in
// `step` s, and makes that its pose. With step 0 the velocities are those of its momenta.
void move_to(RigidBody& rigid, const Pose& next, double step, std::vector<Vec3>& displacement,
             std::vector<Vec3>& velocity);

}  // namespace flexel::simulate
