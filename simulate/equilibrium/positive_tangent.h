// Whether an equilibrium is stable.
#pragma once
#include <optional>

#include "simulate/equilibrium/mechanics.h"

namespace flexel::simulate {

// Whether the tangent at `state` is positive: conjugate gradients on irregular forces (N) meet no direction of negative
// curvature. With loads that follow, its symmetric part: where that is not positive the equilibrium may be stable all
// the same. Nothing: they did not converge, or the run is to stop, under a StopWaits too. Assembles the tangent anew.
[[nodiscard]] std::optional<bool> has_positive_tangent(Mechanics& mechanics, const State& state);

}  // namespace flexel::simulate
