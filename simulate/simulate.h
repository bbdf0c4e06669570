// Body + scene -> deformed body.
#pragma once
#include <string>

#include "base/program/progress.h"
#include "formats/lattice/body.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

struct Scene;  // simulate/scene/scene.h

// Runs the scene on the body, which is moved to its new state. Throws InputError, DivergedError,
// TimeoutError, Interrupted.
[[nodiscard]] SimulateResult simulate(Body& body, const Scene& scene, const SimulateOptions& options,
                                      Progress& progress);

// "90 s", "5 min" in seconds, of `option`. Throws InputError: no time, or none above zero.
[[nodiscard]] double parse_timeout(const std::string& text, const std::string& option = "--timeout");

}  // namespace flexel::simulate
