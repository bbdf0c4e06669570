// By spins in place of changes of the rotation vectors: with loads that have an energy the slope is symmetric then.
#include "simulate/conditions/link_stability.h"

#include <Eigen/LU>
#include <cmath>

#include "base/math/dense.h"

namespace flexel::simulate {
namespace {

constexpr double kSymmetric = 1e-4;  // of the slope's size: what differences and linear solutions leave

}  // namespace

std::optional<bool> link_motions_are_stable(Eigen::MatrixXd slope, std::span<const RigidLink* const> links) {
  for (std::size_t l = 0; l < links.size(); ++l) {
    const auto at = static_cast<Eigen::Index>(6 * l + 3);
    slope.middleCols<3>(at) = (slope.middleCols<3>(at) * links[l]->spin_of_turn().inverse()).eval();
  }
  const Eigen::MatrixXd resists = -0.5 * (slope + slope.transpose()),
                        rest = -0.5 * (slope - slope.transpose());
  const SymmetricEigen part = eigen_symmetric(resists);
  if (part.values.minCoeff() > 0) return true;
  if (Eigen::MatrixXd(-slope).determinant() < 0) return false;
  // The part without energy, as it acts on the motion that the symmetric part drives away.
  const double skew = (rest * part.vectors.col(0)).norm();
  return skew <= kSymmetric * slope.norm() ? std::optional(false) : std::nullopt;
}

}  // namespace flexel::simulate
