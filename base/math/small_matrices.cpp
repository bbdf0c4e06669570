// Called a few times per part or element, never in a time step.
#include "base/math/small_matrices.h"
#include "base/math/eigenvalues.h"

namespace flexel {

Mat3 cross_matrix(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

std::pair<Mat3, bool> inverse_on_range(const Mat3& matrix) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(matrix);
  Mat3 inverse = Mat3::Zero();
  bool whole = true;
  for (int i = 0; i < 3; ++i) {
    const double value = eigen.eigenvalues()[i];
    if (value > 1e-9 * eigen.eigenvalues()[2] && value > 0)
      inverse += eigen.eigenvectors().col(i) * eigen.eigenvectors().col(i).transpose() / value;
    else
      whole = false;
  }
  return {inverse, whole};
}

}  // namespace flexel
