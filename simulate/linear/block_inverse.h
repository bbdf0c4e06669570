// Inverse of a small symmetric block that must never break what is built on it.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>

#include "base/math/eigenvalues.h"

namespace flexel::simulate {

// Symmetric positive semi-definite (N x N) approximation of block^-1: the inverse where the block is positive
// definite; where it is not, eigenvalues count by magnitude and those below 1e-8 N (of the block scaled to a
// unit diagonal) are dropped. Diagonal entries of magnitude below `floor` are taken for absent unknowns.
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, N> guarded_inverse(const Eigen::Matrix<double, N, N>& block,
                                                          double floor) {
  using Square = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;
  constexpr double kSmallest = 1e-8 * N;
  Vector scale;
  bool positive = true;
  for (int c = 0; c < N; ++c) {
    const double diagonal = std::abs(block(c, c));
    scale[c] = diagonal > floor ? 1 / std::sqrt(diagonal) : 0;
    positive = positive && block(c, c) > floor;
  }
  const Square symmetric = .5 * (block + block.transpose());
  const Square scaled = scale.asDiagonal() * symmetric * scale.asDiagonal();
  if (positive) {
    // Squared pivots of Cholesky well above the threshold on eigenvalues: no need for them.
    const Eigen::LLT<Square> factor(scaled);
    if (factor.info() == Eigen::Success && factor.matrixLLT().diagonal().minCoeff() > .03) {
      const Square inverse = factor.solve(Square::Identity());
      return scale.asDiagonal() * (.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Square> eigen(scaled);
  Vector inverse;
  for (int c = 0; c < N; ++c) {
    const double value = std::abs(eigen.eigenvalues()[c]);
    inverse[c] = value > kSmallest ? 1 / value : 0;
  }
  const Square result = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  return scale.asDiagonal() * (.5 * (result + result.transpose())) * scale.asDiagonal();
}

}  // namespace flexel::simulate
