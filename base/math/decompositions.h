// Eigenvalues and singular values of small matrices, by Eigen. Those of the usual sizes are compiled once, in
// decompositions.cpp, and not in each of the twenty files that use them.
#pragma once
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "base/math/vec.h"

namespace Eigen {

#define FLEXEL_EIGENVALUES(Matrix)                                                                           \
  template SelfAdjointEigenSolver<Matrix>& SelfAdjointEigenSolver<Matrix>::compute(const EigenBase<Matrix>&, \
                                                                                   int)
#define FLEXEL_SINGULAR_VALUES(Matrix) \
  template JacobiSVD<Matrix>& JacobiSVD<Matrix>::compute(const Matrix&, unsigned int)

using Matrix6d = Matrix<double, 6, 6>;
using Matrix9d = Matrix<double, 9, 9>;
extern FLEXEL_EIGENVALUES(Matrix3d);
extern FLEXEL_EIGENVALUES(Matrix6d);
extern FLEXEL_EIGENVALUES(Matrix9d);
extern FLEXEL_SINGULAR_VALUES(Matrix3d);

}  // namespace Eigen
