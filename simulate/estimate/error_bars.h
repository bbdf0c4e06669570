// The runs on coarser lattices that error bars come from (simulate/result/estimate.h).
#pragma once
#include <functional>

#include "base/program/progress.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Runs a scene on a body to equilibrium.
using SolveCoarse = std::function<SimulateResult(Body&, const Scene&, const SimulateOptions&, Progress&)>;

// Error bars of `result`, which `scene` gave on `body` (now deformed). Fixes, loads, moves and probes are
// placed anew on each coarser body, from the same selections. What cannot be done is said in the note; the
// run does not fail. Throws Interrupted.
[[nodiscard]] ErrorBars estimate_errors(const Body& body, const Scene& scene, const SimulateOptions& options,
                                        const SimulateResult& result, const SolveCoarse& solve,
                                        Progress& progress);

}  // namespace flexel::simulate
