// A rigid link: selected matter that moves as one rigid body, driven by a force and a couple at a point
// (RBE2).
//
// The matter is tied (effects/supports.h) to a rigid motion whose six numbers nobody gives: a displacement of the
// matter's middle and a rotation about it. The solver looks for those under which the ties pull with the
// force and the couple (simulate/equilibrium/rigid_link_equilibrium.h).
#pragma once
#include <cmath>
#include <string>

#include "base/math/small_matrices.h"
#include "base/math/vec.h"

namespace flexel::simulate {

struct RigidLink {
  std::string name, origin;  // of its load; "beam.toml:12"
  // Given. Force and couple keep their direction where the link turns, or turn with it (follower); they
  // act at `at`, which goes along.
  Vec3 at = Vec3::Zero();                            // m, rest
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  // N, N m: the whole load
  bool follower = false;
  Vec3 middle = Vec3::Zero();  // m, rest: of the matter
  double reach = 1;            // m: how far the matter extends around it
  // Found
  Vec3 translation = Vec3::Zero();  // m, of `middle`
  Vec3 turn = Vec3::Zero();         // rad: rotation vector
  bool small = false;               // to first order in the turn, arms as they are at rest
  // Told by the ties: what they pull the matter with, the moment about the middle where it is now
  Vec3 pull = Vec3::Zero(), pull_moment = Vec3::Zero();  // N, N m

  // Displacement [m] of the material point that rested at `rest`.
  [[nodiscard]] Vec3 displacement(const Vec3& rest) const { return translation + turning(rest - middle); }
  // The force or the couple now.
  [[nodiscard]] Vec3 now(const Vec3& given) const {
    return follower && !small ? Vec3(given + turning(given)) : given;
  }
  // Its spin for a change of `turn` [rad/rad]: the left Jacobian of SO(3).
  [[nodiscard]] Mat3 spin_of_turn() const {
    const double angle = turn.norm();
    if (small || angle < 1e-4) return Mat3::Identity() + (small ? 0 : 0.5) * cross_matrix(turn);
    const Mat3 around = cross_matrix(turn / angle);
    return Mat3::Identity() + (1 - std::cos(angle)) / angle * around +
           (1 - std::sin(angle) / angle) * around * around;
  }

 private:
  // What the turn changes of a vector.
  [[nodiscard]] Vec3 turning(const Vec3& vector) const {
    if (small) return turn.cross(vector);
    const double angle = turn.norm();
    if (angle == 0) return Vec3::Zero();
    // (R - I) arm by half angles: no cancellation for a small angle.
    const Vec3 axis = turn / angle, across = axis.cross(vector);
    const double sine = std::sin(0.5 * angle), cosine = std::cos(0.5 * angle);
    return 2 * sine * (cosine * across + sine * axis.cross(across));
  }
};

}  // namespace flexel::simulate
