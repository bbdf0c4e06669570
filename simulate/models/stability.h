// How long a step may be.
//
// The largest frequency of a body is at most that of its stiffest cell swinging alone (the element eigenvalue
// theorem; Irons and Treharne 1971): with the cell's stiffness K and the mass m = rho V / 8 at its corners,
// omega^2 = max eig(K) / m. Fill scales both, so a sliver is no stiffer than a whole cell. At rest this is
// 2 / omega = h sqrt(rho / max(3 K, 2 mu)) for cubes of model `cells`. Damping with a time tau has the ratio
// zeta = tau omega / 2 there, and the explicit step is stable up to
//     dt <= 2 / omega (sqrt(1 + zeta^2) - zeta)      (Belytschko, Liu, Moran 2000, section 6.2)
#pragma once
#include <vector>

#include "simulate/conditions/kernel_effects.h"
#include "simulate/models/cell_model.h"
#include "simulate/models/spring_model.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// A whole cell of a part at rest. 0 and 0: the part has no cells, or is rigid.
struct CellOfPart {
  CellKind cells;
  SpringKind springs;
  double largest = 0;    // eigenvalue of its stiffness [N/m]
  double frequency = 0;  // omega^2 [1/s^2]
};
[[nodiscard]] std::vector<CellOfPart> cells_of_parts(const Problem& problem);

// omega^2 [1/s^2] of one whole cell at rest, by part. 0: the part has no cells, or is rigid.
[[nodiscard]] std::vector<double> cell_frequencies(const Problem& problem);

// The bound on the step [s] for frequency^2 `omega2` and damping time `tau` [s]; infinity for omega2 = 0, 0
// where it is not finite.
[[nodiscard]] double stable_step(double omega2, double tau);

// Of the whole body at rest, by cells alone. `damping`: tau of each part [s].
[[nodiscard]] double stable_step(const Problem& problem, const std::vector<double>& damping);

// By how much omega^2 of the stiffest cell of each part exceeds that at rest, in the deformed state: at
// least 1. Neo-Hookean stiffness grows as a cell is squeezed; for springs it changes by their strain.
// With plasticity in the plan the stretch of what has flowed counts as stretch of the stiffness, too, which
// bounds it. Infinity: a cell is folded. Springs resist as well inside out, so nothing else tells it of them;
// where they break a cell of which some are left may turn as it likes.
// Rest shapes of the body (simulate/models/rest_shape.h) and what edits made of stiffness and mass count.
// `cells`: cells_of_parts(problem).
[[nodiscard]] std::vector<double> stiffening(const Problem& problem, const std::vector<CellOfPart>& cells,
                                             const std::vector<Vec3>& displacement,
                                             const KernelEffects& plan);

// Likewise of the internal damping over tau (simulate/implicit/damping_matrix.h): at least 1. With A = sym(F^T dF/dt),
// |A| <= |F| |dF/dt|, |dJ/dt| <= |cof F| |dF/dt|; hourglass displacements q feel dF/dt too, |q'| <= |dq/dt| + |dF/dt| |F^-1 q|.
[[nodiscard]] std::vector<double> damping_growth(const Problem& problem, const std::vector<CellOfPart>& cells,
                                                 const std::vector<Vec3>& displacement);

}  // namespace flexel::simulate
