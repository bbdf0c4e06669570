// Eigen's solver of symmetric matrices, compiled once for the sizes that loops ask for (eigenvalues.cpp): each file that has
// one of its own takes seconds longer to compile. The argument must be a matrix of just that type, no expression. Any other
// size: eigen_symmetric() of dense.h.
#pragma once
#include <Eigen/Eigenvalues>

namespace Eigen {

#define FLEXEL_SYMMETRIC_SOLVER(Matrix)                                                                     \
  SelfAdjointEigenSolver<Matrix>& SelfAdjointEigenSolver<Matrix>::compute<Matrix>(const EigenBase<Matrix>&, \
                                                                                  int)

using Matrix6d = Matrix<double, 6, 6>;
using Matrix9d = Matrix<double, 9, 9>;
extern template FLEXEL_SYMMETRIC_SOLVER(Matrix3d);
extern template FLEXEL_SYMMETRIC_SOLVER(Matrix6d);
extern template FLEXEL_SYMMETRIC_SOLVER(Matrix9d);
extern template FLEXEL_SYMMETRIC_SOLVER(MatrixXd);

}  // namespace Eigen
