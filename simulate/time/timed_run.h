// Motion in time: effects and cells are stepped explicitly until the time that the scene gives.
#pragma once
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Runs `scene`, whose [run] has a time, on `body`, from its present positions (and velocities, where it
// carries the column "velocity"), and moves it to its last state. Throws InputError (a step above the stable
// one among others), DivergedError, TimeoutError, Interrupted; the last good state is then saved under
// options.failed_output.
[[nodiscard]] SimulateResult run_in_time(Body& body, const Scene& scene, const SimulateOptions& options,
                                         Progress& progress);

// Brings a scene without a time, with contact or rigid parts, to rest (simulate/time/dynamic_relaxation.h). Throws as
// well DivergedError: it does not come to rest.
[[nodiscard]] SimulateResult settle(Body& body, const Scene& scene, const SimulateOptions& options,
                                    Progress& progress);

}  // namespace flexel::simulate
