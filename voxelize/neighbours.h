// Overlaps and gaps between the parts of a file.
#pragma once
#include <array>
#include <vector>

#include "voxelize/heal/heal.h"

namespace flexel::voxelize {

// Pairs of parts that overlap, or whose gap is less than a cell. The parts, in world coordinates, are
// compared along lines through the intersection of their boxes: overlap volumes by quadrature, a gap as the
// least on any line, both within a few percent. An overlap by less than a hundredth of a cell (1e-6 of the
// diagonal) counts as touching, as it does at equilibrium; so does one of under 1 % of the smaller part if
// the parts touch elsewhere. `spacing` (parts) m, the cells' largest.
[[nodiscard]] std::vector<PartPair> noteworthy_pairs(const std::vector<HealedPart>& parts,
                                                     const std::vector<double>& spacing);

// Throws InputError where two parts are the same body in the same place.
void refuse_duplicates(const std::vector<PartPair>& pairs, const Surface& surface);

}  // namespace flexel::voxelize
