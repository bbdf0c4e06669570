// See direct.h. Unknowns whose diagonal is next to nothing (rotations of degenerate aggregates, elements
// without stiffness) get a diagonal of the matrix's own size, which holds them still.
#include "simulate/linear/direct.h"

#include <cmath>
#include <limits>

namespace flexel::simulate {

void DirectSolver::factorise(const Eigen::SparseMatrix<double>& lower) {
  constexpr double kShift = 1e-9;
  if (lower.rows() == 0) return;
  Eigen::SparseMatrix<double> shifted = lower;
  const Eigen::VectorXd diagonal = shifted.diagonal();
  const double largest = diagonal.size() == 0 ? 0 : diagonal.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < diagonal.size(); ++i) {
    const bool absent = std::abs(diagonal[i]) <= 1e-14 * largest;
    shifted.coeffRef(i, i) += absent ? (largest > 0 ? largest : 1) : kShift * diagonal[i];
  }
  if (!analysed_) factor_.analyzePattern(shifted);
  analysed_ = true;
  factor_.factorize(shifted);
  inverse_pivots_ = factor_.vectorD();
  const double floor = 1e-15 * largest;
  for (double& pivot : inverse_pivots_) {
    // A pivot of zero or not a number (a singular matrix) drops its unknown.
    pivot = std::abs(pivot) > floor ? 1 / std::abs(pivot) : 0;
  }
}

void DirectSolver::solve(double* x) const {
  if (inverse_pivots_.size() == 0) return;
  Eigen::Map<Eigen::VectorXd> vector(x, inverse_pivots_.size());
  work_.noalias() = factor_.permutationP() * vector;
  factor_.matrixL().solveInPlace(work_);
  work_.array() *= inverse_pivots_.array();
  factor_.matrixU().solveInPlace(work_);
  vector.noalias() = factor_.permutationPinv() * work_;
}

namespace {

// (rows) The row that is eliminated first, second ...
std::vector<std::size_t> elimination_order(const LinearOperator& matrix) {
  const auto n = static_cast<Eigen::Index>(matrix.rows());
  std::vector<Eigen::Triplet<char>> lower;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (std::uint64_t q = matrix.row_offsets()[row]; q < matrix.row_offsets()[row + 1]; ++q)
      if (matrix.columns()[q] <= row)
        lower.emplace_back(i, static_cast<Eigen::Index>(matrix.columns()[q]), 1);
  }
  Eigen::SparseMatrix<char> pattern(n, n);
  pattern.setFromTriplets(lower.begin(), lower.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern.selfadjointView<Eigen::Lower>(), order);
  return {order.indices().begin(), order.indices().end()};
}

}  // namespace

bool factor_takes_at_most(const LinearOperator& matrix, double multiplications) {
  // In a solid the order alone takes longer than the answer is worth.
  constexpr std::size_t kManyRows = 20'000;
  constexpr double kSolid = 22;  // couplings a row; 27 within a solid, 21 in a wall of two cells
  const auto rows = static_cast<double>(matrix.rows());
  if (matrix.rows() > kManyRows && static_cast<double>(matrix.row_offsets()[matrix.rows()]) > kSolid * rows)
    return false;
  const std::vector<std::size_t> order = elimination_order(matrix);
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> place(order.size()), parent(order.size(), kNone), seen(order.size(), kNone);
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = k;
  // The paths of the elimination tree from what row k couples with up to k are row k of the factor (Liu 1990).
  std::vector<double> column(order.size(), 0);  // blocks below the diagonal
  double squares = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    seen[k] = k;
    for (std::uint64_t q = matrix.row_offsets()[order[k]]; q < matrix.row_offsets()[order[k] + 1]; ++q)
      for (std::size_t i = place[matrix.columns()[q]]; i < k && seen[i] != k; i = parent[i]) {
        if (parent[i] == kNone) parent[i] = k;
        squares += 2 * column[i] + 1;
        column[i] += 1;
        seen[i] = k;
      }
    if (13.5 * squares > multiplications) return false;
  }
  return true;
}

}  // namespace flexel::simulate
