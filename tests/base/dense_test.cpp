// Decompositions against what defines them.
#include "base/math/dense.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
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

}  // namespace
}  // namespace flexel
