// Vibrations and buckling of model `quadratic`: its stiffness, turned and stressed by the scene's loads, and the consistent mass.
#pragma once
#include <memory>

#include "base/program/progress.h"
#include "simulate/modes/vibrating_body.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// As cell_vibration(). Of [run] buckling the pencil is K_sigma x = mu K x, with the stresses of the linear answer to all loads
// (Corotation::stress_forces); the load factor is -1 / mu.
[[nodiscard]] std::unique_ptr<VibratingBody> quadratic_vibration(const Body& body, const Scene& scene,
                                                                 const SimulateOptions& options,
                                                                 SimulateResult& result, Progress& progress);

}  // namespace flexel::simulate
