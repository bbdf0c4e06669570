// [run] modes and [run] buckling: natural vibrations, and at how much of the loads a part buckles (docs/theory/modes.md).
#pragma once
#include "base/program/progress.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

[[nodiscard]] inline bool asks_for_modes(const Scene& scene) {
  return scene.run.modes.has_value() || scene.run.buckling.has_value();
}

// Finds them; the body is moved to the first shape, and the series of `options` has a frame for each. Throws InputError naming
// what such a run does not have, or that fewer modes exist; DivergedError where the stiffness is not positive.
[[nodiscard]] SimulateResult run_modes(Body& body, const Scene& scene, const SimulateOptions& options,
                                       Progress& progress);

}  // namespace flexel::simulate
