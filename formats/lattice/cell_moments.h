// Moments of the matter in a cell: what integrals of polynomials over it are made of.
//
// With L_i the Lagrange polynomials on the five Gauss points x_i of [0, 1], moment k = i + 5 j + 25 l of a cell
// is the integral of L_i(x) L_j(y) L_l(z) over its matter, x, y, z its own coordinates in [0, 1]^3, in units of
// its volume. A polynomial f of degree 4 along each axis has the integral sum_k f(x_i, x_j, x_l) M_k, exactly; the
// stiffness of a 27-node cell is of that degree (Duester, Parvizian, Yang and Rank 2008 integrate it by
// subdivision; here it follows from the surface alone).
#pragma once
#include <array>
#include <cstddef>

namespace flexel {

constexpr std::size_t kMomentPoints = 5;  // along an axis
constexpr std::size_t kMoments = kMomentPoints * kMomentPoints * kMomentPoints;
using CellMoments = std::array<double, kMoments>;

// Cells with this fill or more are whole but for rounding and need no moments of their own.
constexpr double kWholeFill = 1 - 1e-9;

// Gauss's points and weights on [0, 1].
constexpr std::array<double, kMomentPoints> kGaussPoints = {
    0.046910077030668003601186560850304, 0.23076534494715845448184278964989, 0.5,
    0.76923465505284154551815721035011, 0.953089922969331996398813439149696};
constexpr std::array<double, kMomentPoints> kGaussWeights = {
    0.11846344252809454375713202035996, 0.23931433524968323402064575741782,
    0.28444444444444444444444444444444, 0.23931433524968323402064575741782,
    0.11846344252809454375713202035996};

// L_0 .. L_4 at x.
[[nodiscard]] constexpr std::array<double, kMomentPoints> lagrange_at(double x) {
  std::array<double, kMomentPoints> value{};
  for (std::size_t i = 0; i < kMomentPoints; ++i) {
    value[i] = 1;
    for (std::size_t j = 0; j < kMomentPoints; ++j)
      if (j != i) value[i] *= (x - kGaussPoints[j]) / (kGaussPoints[i] - kGaussPoints[j]);
  }
  return value;
}

// Those of a whole cell.
[[nodiscard]] constexpr CellMoments whole_moments() {
  CellMoments moments{};
  for (std::size_t k = 0; k < kMoments; ++k)
    moments[k] = kGaussWeights[k % 5] * kGaussWeights[k / 5 % 5] * kGaussWeights[k / 25];
  return moments;
}

}  // namespace flexel
