// How a force, a moment or a bearing load is spread over points of a surface (or over elements).
#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

// A point and what it stands for: its share of the surface, or of the matter.
struct LoadedPoint {
  Vec3 position = Vec3::Zero();  // m, rest
  double weight = 0;             // m^2 or m^3
  Vec3 normal = Vec3::Zero();    // unit, outward; of a surface
};

struct WeightedMiddle {
  double total = 0;           // of the weights
  Vec3 place = Vec3::Zero();  // m
};
// Nothing where the weights have no sum.
[[nodiscard]] std::optional<WeightedMiddle> weighted_middle(const std::vector<LoadedPoint>& points);

// Forces [N] at the points that are statically equivalent to `force` [N] at the point `at` together with the
// couple `moment` [N m]: f_q = w_q (a + b x (x_q - c)), c the points' middle (an averaging link, known as
// RBE3; least weighted squares). Without `at` the force acts at c. Nothing where the points lie on a line and
// the moment is about it.
[[nodiscard]] std::optional<std::vector<Vec3>> averaging_link(const std::vector<LoadedPoint>& points,
                                                              const Vec3& force, const Vec3& moment,
                                                              const std::optional<Vec3>& at);

// Forces [N] at the points of a cylindrical face that a pin presses on with `force`: pressure p0 cos(angle to
// the force) where the face looks against it, along the normals, sized so that the resultant is `force`. What
// an uneven face leaves over is spread evenly. Nothing where that is over a fifth of the force: the face does
// not look against it.
[[nodiscard]] std::optional<std::vector<Vec3>> bearing(const std::vector<LoadedPoint>& points,
                                                       const Vec3& force);

struct LoadedMotion {
  Vec3 force, rest, displacement;  // N, m, m
};

// The rotation vector [rad] of what `count` forces act on: of the rigid motion nearest to that of their places, each
// with the weight of its force (Kabsch 1976). Nothing for forces that have no moment about their own middle.
[[nodiscard]] std::optional<Vec3> turn_of_couple(std::size_t count,
                                                 const std::function<LoadedMotion(std::size_t)>& at);

}  // namespace flexel::simulate
