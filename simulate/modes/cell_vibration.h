// Vibrations of models `cells` and `springs`: the tangent of equilibrium and the lumped masses of runs in time.
#pragma once
#include <memory>

#include "base/program/progress.h"
#include "simulate/modes/vibrating_body.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Brings the body to equilibrium where loads act. Throws InputError naming what a run of modes does not have, DivergedError
// where there is no equilibrium. Counts iterations in `result`. References are kept.
[[nodiscard]] std::unique_ptr<VibratingBody> cell_vibration(const Body& body, const Scene& scene,
                                                            const SimulateOptions& options,
                                                            SimulateResult& result, Progress& progress);

}  // namespace flexel::simulate
