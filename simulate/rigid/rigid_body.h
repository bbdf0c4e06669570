// A part that does not deform: six degrees of freedom.
//
// Its elements keep their places in it. Forces act on the elements as on any others; after a step the
// impulses that they took are summed up to that on the whole, and the elements are put where the part has
// gone. Mass and inertia are those of its matter (simulate/matter/masses.h).
//     X+ = X + dt P / m,    R+ = R exp(dt w),   w = J^-1 (M + M+) / 2,   M = R^T L,   M+ = R+^T L
// (P, L momentum and angular momentum about the centre of mass, kicked before; J at rest). The rotation is the
// implicit midpoint rule on the group (Austin, Krishnaprasad and Wang 1993) over a step of tan(dt |w| / 2) * 2 /
// |w| in place of dt, which makes a steady spin exact: second order, and P, L and the energy M . J^-1 M / 2 are
// kept to rounding.
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

// Of matter: about its centre, at rest.
struct MassMoments {
  double mass = 0;             // kg
  Vec3 centre = Vec3::Zero();  // m
  Mat3 second = Mat3::Zero();  // kg m^2, sum of x x^T
};

// Energy and momenta of a free rigid part, which its elements tell to second order in the step only.
struct RigidMomenta {
  std::uint32_t begin = 0, end = 0;  // its elements
  double kinetic = 0;                // J
  Vec3 momentum = Vec3::Zero();      // kg m/s
  Vec3 angular = Vec3::Zero();       // kg m^2/s, about the origin
};

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

[[nodiscard]] RigidBody rigid_body(const Body& body, std::uint32_t part, const MassMoments& matter);

// Fits pose and momenta to where its elements, of `mass` [kg], are and how they move.
void take_up(RigidBody& rigid, const Body& body, const std::vector<double>& mass,
             const std::vector<Vec3>& displacement, const std::vector<Vec3>& velocity);

// rad/s, of that angular momentum where it is turned so.
[[nodiscard]] Vec3 angular_velocity(const RigidBody& rigid, const Mat3& rotation, const Vec3& spin);
// The pose after `step` s with these momenta.
[[nodiscard]] Pose drifted(const RigidBody& rigid, const Vec3& momentum, const Vec3& spin, double step);
// Between the momenta that led to the pose `at` and the present ones.
[[nodiscard]] RigidMomenta momenta_at(const RigidBody& rigid, const Pose& at, const Vec3& momentum_before,
                                      const Vec3& spin_before);

// Puts displacements [m] and velocities [m/s] of its elements where it goes from `rigid.pose` to `next` in
// `step` s, and makes that its pose. With step 0 the velocities are those of its momenta.
void move_to(RigidBody& rigid, const Pose& next, double step, std::vector<Vec3>& displacement,
             std::vector<Vec3>& velocity);

}  // namespace flexel::simulate
