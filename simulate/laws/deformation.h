// What every law is a function of.
#pragma once
#include "base/math/vec.h"

namespace flexel::simulate {

using Mat9 = Eigen::Matrix<double, 9, 9>;  // row and column 3 i + j for component ij
using Mat6 = Eigen::Matrix<double, 6, 6>;  // xx, yy, zz, xy, yz, zx, shears as angles

// Sum of the principal minors of H.
[[nodiscard]] double second_invariant(const Mat3& gradient);

// J - 1 = det(I + H) - 1, without cancellation for small H.
[[nodiscard]] double volume_change(const Mat3& gradient);

}  // namespace flexel::simulate
