// How the parts of a file lie to each other.
#pragma once
#include <array>
#include <vector>

#include "voxelize/heal/heal.h"

namespace flexel::voxelize {

// Pairs of parts that lie in each other, or nearer to each other than a cell without touching. The parts, in
// world coordinates, are compared along lines through the box that a pair has in common, so volumes are those
// of the lines' quadrature and a gap is the least that a line meets, both within a few percent; what is in
// both by less than a hundredth of a cell (1e-6 of the diagonal) counts as touching, as it does at
// equilibrium, and so does what touches elsewhere and has under 1 % of the smaller part in both. `spacing`
// (parts) m, the cells' largest.
[[nodiscard]] std::vector<PartPair> noteworthy_pairs(const std::vector<HealedPart>& parts,
                                                     const std::vector<double>& spacing);

// Throws InputError where two parts are the same body in the same place.
void refuse_duplicates(const std::vector<PartPair>& pairs, const Surface& surface);

}  // namespace flexel::voxelize
