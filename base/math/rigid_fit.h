// The rigid motion nearest to that of some points.
#pragma once
#include <vector>

#include "base/math/vec.h"

namespace flexel {

// x = middle + displacement + rotation (X - middle) of a point that was at X.
struct RigidFit {
  Vec3 middle = Vec3::Zero();        // m, the points' mean before
  Vec3 displacement = Vec3::Zero();  // m, their mean
  Mat3 rotation = Mat3::Identity();
  // Where a point now at `at` was.
  [[nodiscard]] Vec3 before(const Vec3& at) const {
    return middle + rotation.transpose() * (at - middle - displacement);
  }
};

// By least squares (Kabsch 1976) over points at `before` that moved by `displacement` (both m). No turn where they lie on
// a line or did not turn; the identity of no points.
[[nodiscard]] RigidFit rigid_fit(const std::vector<Vec3>& before, const std::vector<Vec3>& displacement);

}  // namespace flexel
