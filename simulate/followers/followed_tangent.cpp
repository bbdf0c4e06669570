// The loads' part as a change of forces, which are on the other side of the equation.
#include "simulate/followers/followed_tangent.h"

#include <algorithm>

#include "base/parallel.h"

namespace flexel::simulate {

void FollowedTangent::multiply(const double* x, double* y) const {
  stiffness_.multiply(x, y);
  std::vector<Vec3> along(rows()), change(rows(), Vec3::Zero());
  std::copy(x, x + 3 * rows(), along.front().data());
  loads_(along, false, change);
  if (symmetric_) {
    loads_(along, true, change);
    for (Vec3& each : change) each *= 0.5;
  }
  parallel_for_each(rows(), [&](std::size_t row) {
    for (int axis = 0; axis < 3; ++axis)
      if (held_.empty() || !(held_[row] >> axis & 1))
        y[3 * row + static_cast<std::size_t>(axis)] -= change[row][axis];
  });
}

}  // namespace flexel::simulate
