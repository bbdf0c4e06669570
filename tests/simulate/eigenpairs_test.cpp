// Eigenpairs of a pencil that is known in closed form.
#include "simulate/modes/eigenpairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace flexel::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A chain of n equal masses m between walls, springs of 1 between them: theta_k = 4 / m sin^2(k pi / (2 n + 2)).
Pencil chain(Index n, double mass) {
  Pencil made;
  made.size = n;
  made.a = [n](const double* x, double* y) {
    for (Index i = 0; i < n; ++i) y[i] = 2 * x[i] - (i > 0 ? x[i - 1] : 0) - (i + 1 < n ? x[i + 1] : 0);
  };
  made.b = [n, mass](const double* x, double* y) {
    for (Index i = 0; i < n; ++i) y[i] = mass * x[i];
  };
  // The inverse of the chain itself (Thomas's algorithm).
  made.precondition = [n](const double* x, double* y) {
    VectorXd factor(n);
    double pivot = 2;
    y[0] = x[0] / pivot;
    for (Index i = 1; i < n; ++i) {
      factor[i] = -1 / pivot;
      pivot = 2 + factor[i];
      y[i] = (x[i] + y[i - 1]) / pivot;
    }
    for (Index i = n - 2; i >= 0; --i) y[i] -= factor[i + 1] * y[i + 1];
  };
  return made;
}

MatrixXd noise(Index rows, Index columns) {
  std::mt19937 random(1);
  MatrixXd made(rows, columns);
  for (double& value : made.reshaped()) value = static_cast<double>(random()) / 4294967296.0 - 0.5;
  return made;
}

TEST(Eigenpairs, AChain) {
  constexpr Index n = 500;
  constexpr double mass = 3;
  const Pencil pencil = chain(n, mass);
  EigenOptions options;
  options.wanted = 6;
  options.tolerance = 1e-7;
  MatrixXd start = noise(n, 9);
  start.col(8) = start.col(0) - 2 * start.col(3);  // depends on others: it is left out
  const Eigenpairs found = lowest_eigenpairs(pencil, start, options);
  ASSERT_TRUE(found.converged);
  ASSERT_EQ(found.values.size(), 6);
  for (Index k = 0; k < 6; ++k) {
    const double half = std::sin(static_cast<double>(k + 1) * std::numbers::pi / (2 * n + 2));
    EXPECT_NEAR(found.values[k], 4 / mass * half * half, 1e-10 * found.values[k]);
  }
  const MatrixXd squares = mass * found.vectors.transpose() * found.vectors;
  EXPECT_LT((squares - MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff(), 1e-10);
}

// As many columns as unknowns: Rayleigh and Ritz alone are exact.
TEST(Eigenpairs, AllOfASmallOne) {
  const Pencil pencil = chain(5, 1);
  EigenOptions options;
  options.wanted = 5;
  const Eigenpairs found = lowest_eigenpairs(pencil, noise(5, 5), options);
  ASSERT_TRUE(found.converged);
  for (Index k = 0; k < 5; ++k) {
    const double half = std::sin(static_cast<double>(k + 1) * std::numbers::pi / 12);
    EXPECT_NEAR(found.values[k], 4 * half * half, 1e-12);
  }
}

// Stops after as many iterations as it may take, and says so.
TEST(Eigenpairs, SaysThatItDidNotConverge) {
  Pencil pencil = chain(500, 1);
  pencil.precondition = [](const double* x, double* y) { std::copy_n(x, 500, y); };
  EigenOptions options;
  options.wanted = 3;
  options.most_iterations = 3;
  const Eigenpairs found = lowest_eigenpairs(pencil, noise(500, 6), options);
  EXPECT_FALSE(found.converged);
  EXPECT_EQ(found.iterations, 3);
}

}  // namespace
}  // namespace flexel::simulate
