// Eigen's solver of symmetric matrices for each size that loops ask for.
#include "base/math/eigenvalues.h"

namespace Eigen {

template FLEXEL_SYMMETRIC_SOLVER(Matrix3d);
template FLEXEL_SYMMETRIC_SOLVER(Matrix6d);
template FLEXEL_SYMMETRIC_SOLVER(Matrix9d);
template FLEXEL_SYMMETRIC_SOLVER(MatrixXd);

}  // namespace Eigen
