// The present shape becomes the rest shape (the paper calls it renormalization).
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/state/state.h"

namespace flexel::simulate {

// Makes the present shape, `displacement` (elements x 3, m), the rest shape of the cells with cells[c] != 0
// and of the connections between elements with elements[e] != 0 (centre placement). Cells that are broken
// stay as they are. Hardening (plastic_strain, spring_strain) does too. Throws DivergedError: a cell or an
// element is turned inside out there.
void renormalise(Body& body, const Problem& problem, const std::vector<Vec3>& displacement,
                 const std::vector<std::uint8_t>& cells, const std::vector<std::uint8_t>& elements);

// Likewise of everything that is simulated.
void renormalise_all(Body& body, const Problem& problem, const std::vector<Vec3>& displacement);

}  // namespace flexel::simulate
