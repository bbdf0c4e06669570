// Model `quadratic`: linear equilibrium with 27-node cells whose stiffness is integrated over the part's matter
// exactly (docs/theory/quadratic.md).
#pragma once
#include "base/program/progress.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Whether it is the model of any part, or of all.
[[nodiscard]] bool asks_for_quadratic(const Scene& scene);

// Whether the scene asks for it on this body. Throws InputError where it does for some parts only.
[[nodiscard]] bool is_quadratic(const Scene& scene, const Body& body);

// Moves the body to equilibrium; its column "quadratic_displacement" has the field between the elements. Throws
// InputError naming what the model does not have; DivergedError where displacements are too large for a linear
// answer, or the solver does not converge. `linear_reach` [m]: the largest displacement in proportion to the load.
[[nodiscard]] SimulateResult run_quadratic(Body& body, const Scene& scene, const SimulateOptions& options,
                                           Progress& progress, double* linear_reach = nullptr);

// Throws InputError where a closer look at the largest stress (simulate/quadratic/local_stress.h) does not take the scene,
// or the model does not.
void refuse_closer_look(const Body& body, const Scene& scene);

class QuadraticSystem;     // simulate/quadratic/quadratic_system.h
struct QuadraticSolution;  // simulate/quadratic/quadratic_solve.h

// Its parts, for other analyses. Throws InputError naming what the model does not have.
void refuse_what_quadratic_lacks(const Scene& scene, const Body& body,
                                 const std::vector<ActiveEffect>& effects);
// The linear solution, and what large deflections make of it. Adds to `seconds`. Throws as solve() and solve_large() do.
[[nodiscard]] QuadraticSolution quadratic_equilibrium(const QuadraticSystem& system, const Scene& scene,
                                                      double& seconds, Progress& progress);

}  // namespace flexel::simulate
