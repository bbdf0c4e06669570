// The rotation is the one nearest to the covariance of where points are and where they were.
#include "base/math/rigid_fit.h"

#include "base/math/dense.h"

namespace flexel {

RigidFit rigid_fit(const std::vector<Vec3>& before, const std::vector<Vec3>& displacement) {
  RigidFit fit;
  if (before.empty()) return fit;
  for (std::size_t i = 0; i < before.size(); ++i) {
    fit.middle += before[i];
    fit.displacement += displacement[i];
  }
  fit.middle /= static_cast<double>(before.size());
  fit.displacement /= static_cast<double>(before.size());
  Mat3 covariance = Mat3::Zero();
  bool moved = false;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3 arm = before[i] - fit.middle;
    const Vec3 bent = displacement[i] - fit.displacement;
    moved = moved || bent.squaredNorm() > 1e-24 * arm.squaredNorm();
    covariance += (arm + bent) * arm.transpose();
  }
  if (!moved) return fit;
  const NearestRotation nearest = nearest_rotation(covariance);
  if (nearest.values[1] > 1e-9 * nearest.values[0]) fit.rotation = nearest.rotation;
  return fit;
}

}  // namespace flexel
