// Decompositions against what defines them.
#include "base/math/dense.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <random>

namespace flexel {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

Matrix3d random_matrix(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Matrix3d matrix;
  for (double& value : matrix.reshaped()) value = normal(random);
  return matrix;
}

Matrix3d random_rotation(std::mt19937& random) {
  return Eigen::Quaterniond(random_matrix(random).row(0).homogeneous().transpose())
      .normalized()
      .toRotationMatrix();
}

TEST(NearestRotation, IsARotationTimesASymmetricStretch) {
  std::mt19937 random(1);
  int reflections = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3d matrix = random_matrix(random);
    const NearestRotation found = nearest_rotation(matrix);
    EXPECT_TRUE(found.rotation.isUnitary(1e-14));
    EXPECT_NEAR(found.rotation.determinant(), 1, 1e-14);
    EXPECT_TRUE((found.rotation * found.stretch).isApprox(matrix, 1e-14));
    EXPECT_TRUE(found.stretch.isApprox(found.stretch.transpose(), 1e-14));
    EXPECT_EQ(found.sense, matrix.determinant() < 0 ? -1 : 1);
    EXPECT_GE(found.values[0], found.values[1]);
    EXPECT_GE(found.values[1], found.values[2]);
    reflections += found.sense < 0;
    for (int other = 0; other < 20; ++other) {
      EXPECT_LE((found.rotation - matrix).norm(), (random_rotation(random) - matrix).norm());
    }
  }
  EXPECT_GT(reflections, 50);
  EXPECT_LT(reflections, 150);
}

TEST(NearestRotation, OfARotatedStretchIsTheRotation) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix3d turn = random_rotation(random), frame = random_rotation(random);
    for (const Vector3d& stretch : {Vector3d(3, 2, 1), Vector3d(1, 1e-3, 1e-6), Vector3d(1, 1, 0)}) {
      const Matrix3d matrix = turn * frame * stretch.asDiagonal() * frame.transpose();
      EXPECT_TRUE(nearest_rotation(matrix).rotation.isApprox(turn, 1e-9)) << stretch.transpose();
    }
  }
}

Eigen::MatrixXd random_matrix(std::mt19937& random, int rows, int columns) {
  std::normal_distribution<double> normal;
  Eigen::MatrixXd matrix(rows, columns);
  for (double& value : matrix.reshaped()) value = normal(random);
  return matrix;
}

TEST(SolveLeastNorm, LeavesAResidualAcrossTheColumnsAndHasNothingAcrossTheRows) {
  std::mt19937 random(3);
  for (const auto& [rows, columns, rank] :
       {std::array{3, 3, 3}, {3, 3, 2}, {7, 4, 4}, {7, 4, 2}, {4, 7, 3}}) {
    const Eigen::MatrixXd matrix = random_matrix(random, rows, rank) * random_matrix(random, rank, columns);
    const Eigen::VectorXd right = random_matrix(random, rows, 1);
    const Eigen::VectorXd x = solve_least_norm(matrix, right);
    EXPECT_LT((matrix.transpose() * (matrix * x - right)).norm(), 1e-12 * matrix.norm() * right.norm());
    const Eigen::VectorXd along = matrix.transpose() * solve_least_norm(matrix.transpose(), x);
    EXPECT_LT((x - along).norm(), 1e-12 * x.norm()) << rows << columns << rank;
  }
  EXPECT_EQ(solve_least_norm(Eigen::MatrixXd::Zero(3, 3), Eigen::VectorXd::Ones(3)),
            Eigen::VectorXd::Zero(3));
}

TEST(SolveSymmetric, IsTheSolution) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const Matrix3d root = random_matrix(random), matrix = root * root.transpose();
    const Eigen::Matrix<double, 3, 6> right = random_matrix(random, 3, 6),
                                      x = solve_symmetric_3(matrix, right);
    EXPECT_LT((root.inverse() * (matrix * x - right)).norm(), 1e-9 * (root.inverse() * right).norm());
    EXPECT_TRUE(solve_symmetric_3(matrix, Vector3d(right.col(2))).isApprox(x.col(2), 1e-9));
  }
}

TEST(Inverse6, TimesTheMatrixIsOne) {
  std::mt19937 random(5);
  const Mat6d matrix = random_matrix(random, 6, 6) + 6 * Mat6d::Identity();
  EXPECT_TRUE((inverse_6(matrix) * matrix).isIdentity(1e-13));
}

TEST(CholeskyFactor, SolvesWherePositiveAndSaysWhereNot) {
  std::mt19937 random(6);
  const Eigen::MatrixXd root = random_matrix(random, 9, 9);
  const Eigen::MatrixXd matrix = root * root.transpose() + Eigen::MatrixXd::Identity(9, 9);
  const CholeskyFactor factor(matrix);
  ASSERT_TRUE(factor.positive());
  const Eigen::VectorXd right = random_matrix(random, 9, 1);
  EXPECT_LT((matrix * factor.solve(right) - right).norm(), 1e-12 * right.norm());
  const Eigen::MatrixXd inverse = factor.inverse_lower();
  EXPECT_TRUE((inverse * matrix * inverse.transpose()).isIdentity(1e-12));
  EXPECT_TRUE(inverse.isLowerTriangular(0));
  EXPECT_FALSE(CholeskyFactor(matrix - 20 * Eigen::MatrixXd::Identity(9, 9)).positive());
}

}  // namespace
}  // namespace flexel
