// A central spring: it pulls its two ends together with k (d - l), d their distance, l the rest length
// (Jansson and Vergeest, equation 2).
#pragma once
#include <algorithm>

#include "simulate/linear/block_matrix.h"

namespace flexel::simulate {

struct Stretch {
  Vec3 direction = Vec3::Zero();  // unit, from the first end to the second
  double length = 0;              // m, d
  double elongation = 0;          // m, d - l
};

// `rest` leads from the first end to the second at rest, `change` is what it changed by [m]. The elongation
// is written as (2 rest . change + change . change) / (d + l), which keeps its digits for small strains.
[[nodiscard]] inline Stretch stretch(const Vec3& rest, const Vec3& change) {
  const Vec3 now = rest + change;
  const double length = now.norm();
  return {now / length, length, (2 * rest.dot(change) + change.squaredNorm()) / (length + rest.norm())};
}

// d2U/du_b du_b = d2U/du_a du_a = -d2U/du_a du_b [N/m] of a spring of `stiffness`. With `project` without the
// negative part that compression brings.
[[nodiscard]] inline Block spring_tangent(double stiffness, const Stretch& now, bool project) {
  const double across = now.elongation / now.length;  // of the stiffness, by tension
  const double kept = project ? std::max(across, 0.0) : across;
  const Mat3 along = now.direction * now.direction.transpose();
  return stiffness * (along + kept * (Mat3::Identity() - along));
}

}  // namespace flexel::simulate
