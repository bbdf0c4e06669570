// Factors of sparse symmetric matrices of many shapes, beside dense solutions.
#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/stop.h"
#include "simulate/linear/direct.h"

namespace flexel::simulate::test {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Lower half of a matrix that couples each row with some before it: `share` of all, and all within `band`.
Sparse coupled(int size, double share, int band, double diagonal, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> any(-1, 1), chance(0, 1);
  std::vector<Eigen::Triplet<double>> entries;
  for (int row = 0; row < size; ++row) {
    entries.emplace_back(row, row, diagonal + any(generator));
    for (int column = 0; column < row; ++column)
      if (row - column <= band || chance(generator) < share)
        entries.emplace_back(row, column, any(generator));
  }
  Sparse lower(size, size);
  lower.setFromTriplets(entries.begin(), entries.end());
  return lower;
}

Eigen::MatrixXd full(const Sparse& lower) {
  const Sparse both = lower.selfadjointView<Eigen::Lower>();
  return Eigen::MatrixXd(both);
}

// How far S = A^-1 by `solver` is from the inverse of `matrix`, of its own size; of one column.
double off(const DirectSolver& solver, const Eigen::MatrixXd& matrix) {
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(matrix.rows(), -1, 2);
  const Eigen::VectorXd wanted = solve_dense(matrix, x);
  solver.solve(x.data());
  return (x - wanted).norm() / wanted.norm();
}

TEST(DirectSolver, SolvesMatricesOfAllShapes) {
  constexpr double kRaised = 1e-7;  // by 1e-9 of the diagonal, of matrices whose condition is under 100
  for (const int size : {1, 2, 7, 60, 150, 400})
    for (const double share : {0.0, 0.01, 0.1, 1.0})
      for (const int band : {0, 1, 5}) {
        const Sparse lower =
            coupled(size, share, band, 2 + 2 * (band + share * size), 7 * static_cast<unsigned>(size));
        DirectSolver solver;
        solver.factorise(lower);
        EXPECT_LT(off(solver, full(lower)), kRaised) << size << " rows, " << share << ", band " << band;
      }
}

TEST(DirectSolver, TakesOtherValuesInTheSamePattern) {
  DirectSolver solver;
  for (const double diagonal : {40.0, 90.0, 41.0}) {
    const Sparse lower = coupled(120, 0.05, 3, diagonal, 3);
    solver.factorise(lower);
    EXPECT_LT(off(solver, full(lower)), 1e-7) << diagonal;
  }
}

TEST(DirectSolver, IsPositiveWhateverTheMatrix) {
  for (unsigned seed = 1; seed < 20; ++seed) {
    Sparse lower = coupled(90, 0.05, 2, 0, seed);  // of both signs
    if (seed % 3 == 0)                             // a row of nothing
      for (int row = 0; row < 90; ++row)
        for (int column = 0; column <= row; ++column)
          if ((row == 11 || column == 11) && lower.coeff(row, column) != 0) lower.coeffRef(row, column) = 0;
    DirectSolver solver;
    solver.factorise(lower);
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 5; ++k) {
      Eigen::VectorXd x(90);
      for (double& value : x) value = normal(generator);
      Eigen::VectorXd y = x;
      solver.solve(y.data());
      EXPECT_GT(x.dot(y), 0) << "seed " << seed;
    }
  }
}

TEST(DirectSolver, MatterThatIsNotConnectedIsSolvedByItself) {
  const Sparse one = coupled(50, 0.1, 2, 20, 1), other = coupled(70, 0.1, 2, 30, 2);
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto& [matrix, from] : {std::pair(&one, 0), std::pair(&other, 50)})
    for (int column = 0; column < matrix->cols(); ++column)
      for (Sparse::InnerIterator entry(*matrix, column); entry; ++entry)
        entries.emplace_back(from + entry.row(), from + column, entry.value());
  Sparse both(120, 120);
  both.setFromTriplets(entries.begin(), entries.end());
  DirectSolver solver;
  solver.factorise(both);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(120);
  x.head(50).setOnes();
  solver.solve(x.data());
  EXPECT_EQ(x.tail(70).norm(), 0);
  EXPECT_LT((full(one) * x.head(50) - Eigen::VectorXd::Ones(50)).norm(), 1e-6);
}

TEST(DirectSolver, IsStoppedAndGoesOnLater) {
  const Sparse lower = coupled(300, 0.05, 3, 60, 5);
  DirectSolver solver;
  const auto stopped = [&] {
    const StopAfter limit(0, "a test");
    solver.factorise(lower);
  };
  EXPECT_THROW(stopped(), TimeoutError);
  solver.factorise(lower);
  EXPECT_LT(off(solver, full(lower)), 1e-7);
  EXPECT_THROW(stopped(), TimeoutError);  // its pattern known
  solver.factorise(lower);
  EXPECT_LT(off(solver, full(lower)), 1e-7);
}

}  // namespace
}  // namespace flexel::simulate::test
