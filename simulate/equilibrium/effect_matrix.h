// What effects (ties, bonds) add to a tangent stiffness whose cells are not stored
// (simulate/equilibrium/cell_stiffness.h).
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/linear/block_matrix.h"

namespace flexel::simulate {

// A matrix of zeros with the rows and columns of `pattern` that effects add to: those of the elements that
// they pull at, and of their neighbours.
[[nodiscard]] BlockMatrix matrix_of_effects(const Body& body, const BlockMatrix& pattern,
                                            const std::vector<ActiveEffect>& effects);

// Likewise without a pattern: where elements are coupled by the cells with active[cell] != 0 alone.
[[nodiscard]] BlockMatrix matrix_of_effects(const Body& body, const std::vector<std::uint8_t>& active,
                                            const std::vector<ActiveEffect>& effects);

}  // namespace flexel::simulate
