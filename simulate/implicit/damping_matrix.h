// The internal damping as a matrix, for implicit steps: forces -C v, C symmetric and positive semi-definite.
#pragma once
#include "simulate/models/paper_model.h"
#include "simulate/models/stiffness.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// Sets every value of `matrix` [N s/m], which has the pattern that `stencil` and `paper` belong to: C of cells, springs
// and connections displaced by `displacement` [m] (elements), the same as that of explicit steps
// (simulate/kernels/kernel_table.cpp, PaperModel::add_damping()). `damping`: the time tau of each part [s].
void set_damping(const Problem& problem, const Stencil& stencil, const PaperModel& paper,
                 const std::vector<double>& damping, const std::vector<Vec3>& displacement,
                 BlockMatrix& matrix);

}  // namespace flexel::simulate
