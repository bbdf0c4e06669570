// Direct solution of small systems: the coarsest level, and matrices too small for a hierarchy.
#pragma once
#include <Eigen/SparseCore>
#include <type_traits>
#include <vector>

#include "base/math/vec.h"
#include "simulate/linear/operator.h"

namespace flexel::simulate {

// LDL^T (supernodes, left-looking: Ng and Peyton 1993; approximate minimum degree) of a symmetric matrix whose diagonal is
// raised by one part in 1e9. Pivots count by magnitude, so that the solution operator is positive definite whatever
// the matrix. Serial: the same bits for any thread count.
// Why no library's: Eigen's LDL^T has no supernodes, CHOLMOD has them for positive definite matrices alone (LL^T), by a BLAS whose
// bits differ between processors; and neither can be stopped.
class DirectSolver {
 public:
  // Takes the lower half. The pattern of a second call must be that of the first. May be stopped (base/stop.h), and is to be called
  // again then.
  void factorise(const Eigen::SparseMatrix<double>& lower);
  // x = A^-1 x in place; x has one value per row.
  void solve(double* x) const;

 private:
  // Columns next to each other that have the same rows below them: a dense matrix, by columns, of their own rows and those.
  struct Supernode {
    int first = 0, width = 0;
    std::size_t rows = 0, below = 0;  // those below: where they begin in rows_, how many
    std::size_t values = 0;           // where it begins in values_
  };
  using Panel = Eigen::Map<Eigen::MatrixXd>;

  void analyse(const Eigen::SparseMatrix<double>& lower);
  void find_supernodes(const std::vector<int>& parent, const std::vector<int>& below);
  void find_rows(const Eigen::SparseMatrix<double>& lower);
  void update(const Supernode& from, std::size_t begin, std::size_t end, Panel& panel);
  void eliminate(const Supernode& node, double least, Panel& panel);
  [[nodiscard]] std::size_t height(const Supernode& node) const {
    return static_cast<std::size_t>(node.width) + node.below;
  }

  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order_;  // from rows to places
  std::vector<Supernode> supernodes_;                                    // ascending
  std::vector<int> supernode_of_;                                        // (columns)
  std::vector<int> rows_;                                                // ascending in each supernode
  std::vector<double> values_;  // unit lower triangles; what is above the diagonals is of no meaning
  Eigen::VectorXd pivots_, inverse_pivots_;
  std::vector<int> local_;  // (rows) place in the panel at hand
  // Not Eigen's: a matrix of its whose memory does not suffice for another size is freed twice (3.4).
  std::vector<double> product_;
  mutable std::vector<double> below_;
  mutable Eigen::VectorXd work_;
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
