// Equilibrium of model `quadratic` where the linear answer is not enough: Newton's method with cells that turn
// (simulate/quadratic/corotation.h), in as many load steps as it takes.
#pragma once
#include <functional>

#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {

// Takes a linear solution, which may be rough, to equilibrium under the whole load. False where the linear stiffness shows as
// indefinite (solve()). Throws DivergedError naming the share of the load that was reached. `linear` is told as in solve(),
// `progress` the share and the residual, relative to loads and reactions, before each iteration of Newton's.
[[nodiscard]] bool solve_large(const QuadraticSystem& system, const RunSettings& settings,
                               const std::string& scene, const std::function<void(int, double)>& linear,
                               const std::function<void(double, double)>& progress,
                               QuadraticSolution& solution);

// The same from a displacement near it (with a tangent that fits it roughly), of cells that turn, whether that matters or not. False where
// the stiffness shows as indefinite.
[[nodiscard]] bool follow_turns(const QuadraticSystem& system, const RunSettings& settings,
                                const std::string& scene, const std::function<void(double, double)>& progress,
                                QuadraticSolution& solution);

}  // namespace flexel::simulate
