// Runs a scene on a body, at equilibrium or in time, and tells what it says.
#pragma once
#include <string>

#include "formats/error.h"
#include "simulate/scene.h"
#include "simulate/simulate.h"

namespace flexel::testing {

inline SimulateResult run(Body& body, const Scene& scene) {
  Progress progress("test", Progress::Mode::quiet);
  return simulate(body, scene, {}, progress);
}

// The message that the scene is refused with; "accepted" where it is not.
inline std::string refusal(Body body, const Scene& scene) {
  try {
    (void)run(body, scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace flexel::testing
