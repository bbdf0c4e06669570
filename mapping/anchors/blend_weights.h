// Weights of the elements around a point. Distances are in spacings along the lattice's axes, so the weights
// do not depend on the unit or on the part's position.
#pragma once
#include <array>
#include <cstdint>

#include "base/math/vec.h"

namespace flexel::mapping {

// Support radius of the weights, in spacings, of `blended` and of `smooth`.
constexpr double kBlendRadius = 2.0;
constexpr double kSmoothRadius = 3.2;
// In a whole lattice, the elements within that radius are at most this many connections from every corner of
// the point's cell. Those farther along connections lie across a gap.
constexpr int kBlendSteps = 2;
constexpr int kSmoothSteps = 3;

// Wendland's function (1 - r)^4 (4 r + 1): twice continuously differentiable, 0 from r = 1 on (H. Wendland,
// "Piecewise polynomial, positive definite and compactly supported radial functions of minimal degree",
// Advances in Computational Mathematics 4, 1995). Its derivative is -20 r (1 - r)^3.
template <class Scalar>
[[nodiscard]] inline Scalar wendland(Scalar r) {
  const Scalar left = r < Scalar(1) ? Scalar(1) - r : Scalar(0);
  const Scalar square = left * left;
  return square * square * (Scalar(4) * r + Scalar(1));
}

// The weights of the cell's corners at a point `within` it (0 to 1 along each axis): products of 6 t^5 - 15
// t^4 + 10 t^3; they sum to 1. They make the influence of an element that only some corners are connected
// with (past the end of a slit) twice continuously differentiable.
[[nodiscard]] inline double smooth_step(double t) {
  const double c = t < 0 ? 0 : t > 1 ? 1 : t;
  return c * c * c * (c * (6 * c - 15) + 10);
}
[[nodiscard]] inline double smooth_step_slope(double t) {
  return t <= 0 || t >= 1 ? 0 : 30 * t * t * (1 - t) * (1 - t);
}
[[nodiscard]] inline std::array<double, 8> anchor_shares(const Vec3& within) {
  const double x = smooth_step(within.x()), y = smooth_step(within.y()), z = smooth_step(within.z());
  std::array<double, 8> share{};
  for (unsigned a = 0; a < 8; ++a) share[a] = (a & 1 ? x : 1 - x) * (a & 2 ? y : 1 - y) * (a & 4 ? z : 1 - z);
  return share;
}

}  // namespace flexel::mapping
