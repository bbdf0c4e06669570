// Scenes of gum; runs a scene on a body, at equilibrium or in time, and tells what it says.
#pragma once
#include <string>

#include "base/error.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"

namespace flexel::simulate::testing {

constexpr double kGumYoung = 1e6;  // Pa

inline Scene gum_scene(double poisson = 0.3) {
  Scene scene;
  scene.materials["gum"] = {"gum", kGumYoung, poisson, 1000, "test"};
  scene.material = "gum";
  return scene;
}

inline SimulateResult simulate_quietly(Body& body, const Scene& scene, int threads = 0) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.threads = threads;
  return simulate(body, scene, options, progress);
}

// The message that the scene is refused with; "accepted" where it is not.
inline std::string refusal(Body body, const Scene& scene) {
  try {
    (void)simulate_quietly(body, scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace flexel::simulate::testing
