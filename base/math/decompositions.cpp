// The sizes that several files need.
#include "base/math/decompositions.h"

namespace Eigen {

FLEXEL_EIGENVALUES(Matrix3d);
FLEXEL_EIGENVALUES(Matrix6d);
FLEXEL_EIGENVALUES(Matrix9d);
FLEXEL_SINGULAR_VALUES(Matrix3d);

}  // namespace Eigen
