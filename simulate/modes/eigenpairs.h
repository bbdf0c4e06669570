// The lowest eigenpairs of a symmetric pencil, A x = theta B x, B positive definite: LOBPCG.
#pragma once
#include <Eigen/Core>
#include <functional>

namespace flexel::simulate {

// y = F x, both (size) and apart. One call at a time; the same bits for any thread count.
using LinearMap = std::function<void(const double* x, double* y)>;

struct Pencil {
  Eigen::Index size = 0;
  LinearMap a, b;
  // An approximation T of the inverse of A, or of B where `inverts_b`; symmetric and positive definite.
  LinearMap precondition;
  bool inverts_b = false;
  double rounding = 0;  // an eigenvalue under this is told from 0 by nothing: rounding in A
};

struct EigenOptions {
  Eigen::Index wanted = 1;  // at most as many as the starting columns; more of those converge faster
  double tolerance =
      1e-4;  // of a shape in the energy norm; the relative error of its eigenvalue is about the square
  int most_iterations = 200;
};

struct Eigenpairs {
  Eigen::VectorXd values;   // (wanted) rising
  Eigen::MatrixXd vectors;  // (size x wanted) orthonormal in B
  // (wanted) of a shape in the energy norm, as far as T tells it: sqrt(r . T r / theta), r = A x - theta B x
  Eigen::VectorXd errors;
  int iterations = 0;
  bool converged = false;
};

// Locally optimal block preconditioned conjugate gradients (Knyazev 2001). `start`: (size x block), any columns, those that depend
// on others are left out; the answer has fewer than `wanted` where not as many are independent. `progress` is told each iteration
// and how many have converged; it may throw to interrupt.
[[nodiscard]] Eigenpairs lowest_eigenpairs(const Pencil& pencil, Eigen::MatrixXd start,
                                           const EigenOptions& options,
                                           const std::function<void(int, Eigen::Index)>& progress = {});

}  // namespace flexel::simulate
