// The largest stress, looked at on finer and finer cells around it (docs/theory/local-stress.md).
//
// Each look is a submodel (submodel.h) with cells half as large as those of the last. It ends where the error bar of the sequence of values is
// narrow, or the steps are used up. Other places whose stress and doubt together are above what was found are looked at in turn.
#pragma once
#include "simulate/matter/stress.h"
#include "simulate/quadratic/quadratic_solve.h"
#include "simulate/result/options.h"

namespace flexel::simulate {

// What of the scene it does not take, in words; "" if nothing.
[[nodiscard]] std::string local_stress_lacks(const QuadraticSystem& system);

// m, from supports, bonds and sharp edges, off by up to a cell: beyond it lies what was looked at where the largest stress has no limit.
[[nodiscard]] double clear_of_singular(const LocalStress& local);

struct LocalStressField {
  // Of the largest stress; where that lies where it has no limit, of the largest that is clear_of_singular().
  LocalStress found;
  Stresses field;  // of the body, with what was found where it was looked closer
};

// `field`: field_stresses() of the body; `singular`: (elements) for singular_beside(). The run's own displacement stays as it is. Throws
// InputError, DivergedError where a look cannot be taken.
[[nodiscard]] LocalStressField look_closer(const QuadraticSystem& system, const QuadraticSolution& solution,
                                           const Scene& scene, const CutBox& cut, const Stresses& field,
                                           const std::vector<std::uint8_t>& singular, Progress& progress);

}  // namespace flexel::simulate
