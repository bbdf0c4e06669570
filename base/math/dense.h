// Decompositions of small dense matrices by Eigen, compiled once: each file that has them of its own takes seconds longer.
#pragma once
#include <Eigen/Core>

namespace flexel {

using Mat6d = Eigen::Matrix<double, 6, 6>;

// Of a symmetric matrix: eigenvalues rising, eigenvectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] SymmetricEigen eigen_symmetric(const Eigen::MatrixXd& matrix);
[[nodiscard]] SymmetricEigen eigen_symmetric_6(const Mat6d& matrix);
[[nodiscard]] Eigen::VectorXd eigenvalues_symmetric(const Eigen::MatrixXd& matrix);
[[nodiscard]] Eigen::VectorXd eigenvalues_symmetric_6(const Mat6d& matrix);

// matrix = u diag(values) v^T, u and v square, singular values falling (one-sided Jacobi rotations).
struct SingularValues {
  Eigen::MatrixXd u;
  Eigen::VectorXd values;
  Eigen::MatrixXd v;
};
[[nodiscard]] SingularValues singular_values(const Eigen::MatrixXd& matrix);

// matrix = rotation stretch, the stretch symmetric: of all rotations that nearest to the matrix (Kabsch 1976). The singular
// values fall; the matrix is of a reflection where `sense` is -1 (1 else).
struct NearestRotation {
  Eigen::Matrix3d rotation, stretch;
  Eigen::Vector3d values;
  double sense;
};
[[nodiscard]] NearestRotation nearest_rotation(const Eigen::Matrix3d& matrix);

// An orthonormal base of the span of the columns, by Householder's reflections.
[[nodiscard]] Eigen::MatrixXd orthonormal_base(const Eigen::MatrixXd& columns);

// matrix x = right, by Gaussian elimination with full pivoting.
[[nodiscard]] Eigen::VectorXd solve_dense(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// Of all x that come nearest to matrix x = right the shortest, by singular values.
[[nodiscard]] Eigen::VectorXd solve_least_norm(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// matrix x = right of a symmetric positive semidefinite matrix, by L D L^T with pivoting.
[[nodiscard]] Eigen::Vector3d solve_symmetric_3(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right);
[[nodiscard]] Eigen::Matrix<double, 3, 6> solve_symmetric_3(const Eigen::Matrix3d& matrix,
                                                            const Eigen::Matrix<double, 3, 6>& right);

[[nodiscard]] Mat6d inverse_6(const Mat6d& matrix);

// L L^T of a symmetric matrix (Cholesky).
class CholeskyFactor {
 public:
  explicit CholeskyFactor(const Eigen::MatrixXd& matrix);

  // Whether the matrix was positive definite; what follows asks that it was.
  [[nodiscard]] bool positive() const { return positive_; }
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  // L^-1
  [[nodiscard]] Eigen::MatrixXd inverse_lower() const;

 private:
  Eigen::MatrixXd lower_;
  bool positive_;
};

}  // namespace flexel
