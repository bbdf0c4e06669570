// Whether the motions of rigid links are stable.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "simulate/conditions/rigid_link.h"

namespace flexel::simulate {

// `slope` (6 links x 6 links, N/m): what each link's load has more than its ties pull (force, moment about the middle over
// the reach), by the link's motion (translation, change of the rotation vector times the reach), the elements following.
//
// A torque that keeps its direction has no energy, and the slope is not symmetric then. True: its symmetric part resists
// every motion, so no other equilibrium branches off. False: the determinant says that an odd number of motions is driven
// away, or the symmetric part that some is, and the slope is symmetric. Nothing: neither, and none of the two tells.
[[nodiscard]] std::optional<bool> link_motions_are_stable(Eigen::MatrixXd slope,
                                                          std::span<const RigidLink* const> links);

}  // namespace flexel::simulate
