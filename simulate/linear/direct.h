// Direct solution of small systems: the coarsest level, and matrices too small for a hierarchy.
#pragma once
#include <Eigen/SparseCholesky>
#include <vector>

#include "base/math/vec.h"
#include "simulate/linear/operator.h"

namespace flexel::simulate {

// LDL^T (Eigen's SimplicialLDLT, approximate minimum degree) of a symmetric matrix whose diagonal is raised
// by one part in 1e9. Pivots count by magnitude, so that the solution operator is positive definite whatever
// the matrix.
class DirectSolver {
 public:
  // Takes the lower half. The pattern of a second call must be that of the first.
  void factorise(const Eigen::SparseMatrix<double>& lower);
  // x = A^-1 x in place; x has one value per row.
  void solve(double* x) const;

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::VectorXd inverse_pivots_;
  mutable Eigen::VectorXd work_;
  bool analysed_ = false;
};

// Whether factorise() takes no more multiplications of a symmetric matrix of 3x3 blocks, by its pattern: 27 / 2 of a pair of
// blocks in a column of the factor. False without a count for large solids, which always take more.
[[nodiscard]] bool factor_takes_at_most(const LinearOperator& matrix, double multiplications);

// Lower half of a matrix of RxR blocks.
template <class View>
[[nodiscard]] Eigen::SparseMatrix<double> lower_half(const View& matrix) {
  constexpr int R = std::decay_t<decltype(matrix.values[0])>::RowsAtCompileTime;
  const auto n = static_cast<Eigen::Index>(matrix.rows()) * R;
  Eigen::SparseMatrix<double> lower(n, n);
  // The matrix is symmetric: row i of its upper half is column i of the lower one, already in ascending
  // order.
  std::vector<int> sizes(static_cast<std::size_t>(n), 0);
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q) {
      if (matrix.columns[q] < i) continue;
      for (int c = 0; c < R; ++c)
        sizes[i * R + static_cast<std::size_t>(c)] += matrix.columns[q] == i ? R - c : R;
    }
  }
  lower.reserve(sizes);
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (int c = 0; c < R; ++c) {
      for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q) {
        const std::size_t j = matrix.columns[q];
        if (j < i) continue;
        for (int r = j == i ? c : 0; r < R; ++r) {
          lower.insert(static_cast<Eigen::Index>(j) * R + r, static_cast<Eigen::Index>(i) * R + c) =
              matrix.values[q](c, r);
        }
      }
    }
  }
  lower.makeCompressed();
  return lower;
}

}  // namespace flexel::simulate
