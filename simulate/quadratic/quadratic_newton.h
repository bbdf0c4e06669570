// Equilibrium of model `quadratic` where the linear answer is not enough: Newton's method with cells that turn
// (simulate/quadratic/corotation.h), in as many load steps as it takes.
#pragma once
#include <functional>

#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {

// Takes the linear solution to equilibrium under the whole load. Throws DivergedError naming the share of the load that was
// reached. `progress` is told the share and the residual, relative to the cells' forces, before each iteration.
void solve_large(const QuadraticSystem& system, const RunSettings& settings, const std::string& scene,
                 const std::function<void(double, double)>& progress, QuadraticSolution& solution);

}  // namespace flexel::simulate
