// Matrices (3 x 3) that several models need.
#pragma once
#include <utility>

#include "base/math/vec.h"

namespace flexel {

// [a]: cross_matrix(a) b = a x b.
[[nodiscard]] Mat3 cross_matrix(const Vec3& a);

// Inverse of a symmetric positive semidefinite matrix on its range (the Moore-Penrose inverse; eigenvalues
// under 1e-9 of the largest count as zero), and whether the range is all of space.
[[nodiscard]] std::pair<Mat3, bool> inverse_on_range(const Mat3& matrix);

}  // namespace flexel
