// A prescribed motion: a rotation about an axis, then a translation, both in proportion to the load share, or
// in a timed run to the factor of a course.
#pragma once
#include <Eigen/Geometry>
#include <memory>

#include "simulate/conditions/rigid_link.h"

namespace flexel::simulate {

struct Motion {
  Vec3 translation = Vec3::Zero();            // m
  Vec3 axis = Vec3::UnitZ();                  // unit
  Vec3 through = Vec3::Zero();                // m, a point of the axis
  double angle = 0;                           // rad, right-handed about axis
  std::shared_ptr<RigidLink> link = nullptr;  // it leads, at any share, in place of all above
  bool from_rest = false;                     // whatever Constraints::start says

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
    }
    return moved;
  }
};

}  // namespace flexel::simulate
