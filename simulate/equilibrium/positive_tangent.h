// Whether an equilibrium is stable.
#pragma once
#include <optional>

#include "simulate/equilibrium/mechanics.h"
#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

// Whether the tangent at `state` is positive: conjugate gradients on irregular forces (N) meet no direction of negative
// curvature, nor do motions of rigid links. With loads that follow, its symmetric part: where that is not positive the equilibrium may be stable all
// the same. Nothing: they did not converge, or the run is to stop, under a StopWaits too. Assembles the tangent anew.
// `near`: a preconditioner of Mechanics::tangent() as it was nearby, whose coarser levels are kept; null: one is made,
// which takes longer than the rest.
[[nodiscard]] std::optional<bool> has_positive_tangent(Mechanics& mechanics, const State& state,
                                                       Preconditioner* near = nullptr);

}  // namespace flexel::simulate
