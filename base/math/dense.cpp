// Eigen's own solvers, each once.
#include "base/math/dense.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <limits>

#include "base/math/eigenvalues.h"

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

Eigen::VectorXd solve_least_norm(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  const SingularValues found = singular_values(matrix);
  const double least = static_cast<double>(std::max(matrix.rows(), matrix.cols())) *
                       std::numeric_limits<double>::epsilon() *
                       (found.values.size() > 0 ? found.values[0] : 0);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(matrix.cols());
  for (Eigen::Index i = 0; i < found.values.size() && found.values[i] > least; ++i)
    x += found.u.col(i).dot(right) / found.values[i] * found.v.col(i);
  return x;
}

Eigen::Vector3d solve_symmetric_3(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right) {
  return matrix.ldlt().solve(right);
}

Eigen::Matrix<double, 3, 6> solve_symmetric_3(const Eigen::Matrix3d& matrix,
                                              const Eigen::Matrix<double, 3, 6>& right) {
  return matrix.ldlt().solve(right);
}

Mat6d inverse_6(const Mat6d& matrix) {
  return matrix.inverse();
}

CholeskyFactor::CholeskyFactor(const Eigen::MatrixXd& matrix) {
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  lower_ = factor.matrixL();
  positive_ = factor.info() == Eigen::Success;
}

Eigen::VectorXd CholeskyFactor::solve(const Eigen::VectorXd& right) const {
  const auto lower = lower_.triangularView<Eigen::Lower>();
  return lower.transpose().solve(lower.solve(right));
}

Eigen::MatrixXd CholeskyFactor::inverse_lower() const {
  return lower_.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(lower_.rows(), lower_.cols()));
}

}  // namespace flexel
