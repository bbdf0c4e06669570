// Stresses of model `quadratic`: of the field itself, at the part's own surface.
//
// Along the surface the strain is that of the field, which the matter under it and around it holds. Across it nothing does,
// but what acts there is known: nothing, or a pressure p. So of the strain e of the field
//     sigma = A : (e + 1/2 (a n^T + n a^T)),   Q a = -p n - (A : e) n,   Q_ik = n_j A_ijkl n_l,
// which has sigma n = -p n and leaves the strain along the surface as it is (as boundary elements find stresses; Brebbia,
// Telles and Wrobel 1984). Where supports hold, or other loads act, the stress is A : e.
#pragma once
#include "simulate/matter/stress.h"
#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {

// As `stresses()` defines them. Of a cell in the middle of its matter; of an element there where it lies in the matter, else
// at the nearest point of the surface in the cells around it. Samples: simulate/matter/surface_samples.h. Of a vertex the largest (von
// Mises) on the smooth surfaces that meet there. The largest of a part's samples is also that of the nearest element and vertex.
// `core`: of a submodel, where a sample may be the largest; null: everywhere.
[[nodiscard]] Stresses field_stresses(const QuadraticSystem& system, const QuadraticSolution& solution,
                                      const State& state, const VoxelRange* core = nullptr);

}  // namespace flexel::simulate
