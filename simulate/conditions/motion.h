// A prescribed motion: a rotation about an axis, then a translation, both in proportion to the load share, or
// in a timed run to the factor of a course.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <optional>

#include "simulate/conditions/rigid_link.h"

namespace flexel::simulate {

struct Motion {
  Vec3 translation = Vec3::Zero();            // m
  Vec3 axis = Vec3::UnitZ();                  // unit
  Vec3 through = Vec3::Zero();                // m, a point of the axis
  double angle = 0;                           // rad, right-handed about axis
  std::shared_ptr<RigidLink> link = nullptr;  // it leads, at any share, in place of all above
  bool from_rest = false;                     // whatever Constraints::start says
  // m, rest: the straight way from here to `through` becomes an arc of the angle and of the same length,
  // which starts as it did
  std::optional<Vec3> arc_from = {};

  // Displacement [m] of the material point that rested at `rest` when `share` of the motion is done. Affine
  // in `rest`.
  [[nodiscard]] Vec3 displacement(const Vec3& rest, double share) const {
    if (link) return link->displacement(rest);
    Vec3 moved = share * translation;
    if (angle != 0) {
      const Vec3 arm = rest - through;
      // (R - I) arm by half angles: no cancellation for a small angle.
      const double half = 0.5 * angle * share;
      const Vec3 across = axis.cross(arm);
      moved += 2 * std::sin(half) * (std::cos(half) * across + std::sin(half) * axis.cross(across));
      if (arc_from) moved += off_the_straight(angle * share);
    }
    return moved;
  }

 private:
  // m, of the end of an arc from `arc_from` by `turn` [rad], from the end of the straight way
  [[nodiscard]] Vec3 off_the_straight(double turn) const {
    constexpr double kSmall =
        1e-3;  // rad: beyond it sin(turn) / turn - 1 cancels no more than the last digits
    if (turn == 0) return Vec3::Zero();
    const Vec3 way = through - *arc_from, across = axis.cross(way);
    const double square = turn * turn, half = std::sin(0.5 * turn);
    const double short_by =
        std::abs(turn) < kSmall ? square / 6 * (1 - square / 20) : 1 - std::sin(turn) / turn;
    return short_by * axis.cross(across) + 2 * half * half / turn * across;
  }
};

}  // namespace flexel::simulate
