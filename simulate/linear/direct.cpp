// See direct.h. Unknowns whose diagonal is next to nothing (rotations of degenerate aggregates, elements
// without stiffness) get a diagonal of the matrix's own size, which holds them still.
#include "simulate/linear/direct.h"

#include <cmath>

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

// Of the pattern of the blocks: a column of c blocks takes 27 / 2 c^2.
double factor_operations(const LinearOperator& matrix) {
  struct Factor : Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> {
    [[nodiscard]] double squares() const { return m_nonZerosPerCol.cast<double>().squaredNorm(); }
  };
  const auto n = static_cast<Eigen::Index>(matrix.rows());
  std::vector<Eigen::Triplet<double>> lower;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (std::uint64_t q = matrix.row_offsets()[row]; q < matrix.row_offsets()[row + 1]; ++q)
      if (matrix.columns()[q] <= row)
        lower.emplace_back(i, static_cast<Eigen::Index>(matrix.columns()[q]), 1);
  }
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(lower.begin(), lower.end());
  Factor factor;
  factor.analyzePattern(pattern);
  return 13.5 * factor.squares();
}

}  // namespace flexel::simulate
