// Eigen's own solvers, each once.
#include "base/math/dense.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace flexel {

SymmetricEigen eigen_symmetric(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

SymmetricEigen eigen_symmetric_6(const Mat6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Mat6d> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigen::VectorXd eigenvalues_symmetric(const Eigen::MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigen::VectorXd eigenvalues_symmetric_6(const Mat6d& matrix) {
  return Eigen::SelfAdjointEigenSolver<Mat6d>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

SingularValues singular_values(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

NearestRotation nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d senses = Eigen::Matrix3d::Identity();
  senses(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return {svd.matrixU() * senses * svd.matrixV().transpose(),
          svd.matrixV() * (senses * svd.singularValues().asDiagonal()) * svd.matrixV().transpose(),
          svd.singularValues(), senses(2, 2)};
}

Eigen::MatrixXd orthonormal_base(const Eigen::MatrixXd& columns) {
  return columns.householderQr().householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

Eigen::VectorXd solve_dense(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  return matrix.fullPivLu().solve(right);
}

}  // namespace flexel
