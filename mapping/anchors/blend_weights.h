// The weights that blend what the elements around a point say, on the lattice: distances are counted in
// spacings along the lattice's axes, so that they do not depend on the unit or on where the part lies.
#pragma once
#include <array>
#include <cstdint>

#include "base/math/vec.h"

namespace flexel::mapping {

// How far from the point an element is still heard, in spacings: by `blended` and by `smooth`.
constexpr double kBlendRadius = 2.0;
constexpr double kSmoothRadius = 3.2;
// Connections within which those elements lie in a whole lattice, from every corner of the point's cell. What
// is farther along connections lies across a gap.
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

// How much each anchor counts for a point at `within` (a cell's corners 0 and 1 along each axis): products of
// 6 t^5 - 15 t^4 + 10 t^3, so that an element that only some corners reach (across the root of a slit) comes
// in with two continuous derivatives. They sum to 1.
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
