// How much the strain differs from cell to cell: what a lattice leaves out of a deformation, which falls in
// proportion to its spacing.
#pragma once
#include <vector>

#include "simulate/state/state.h"

namespace flexel::simulate {

// (parts) the largest difference of Green's strain, in the Frobenius norm, between the middles of two cells
// with a common face, or of two opposite faces of one, which sees the bending of what is one cell thick.
// Infinity where a displacement is not finite. Broken cells are left out. The same bits for any number of
// threads.
[[nodiscard]] std::vector<double> strain_jumps(const Body& body, const State& state);

}  // namespace flexel::simulate
