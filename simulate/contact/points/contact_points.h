// Where a body can touch: points on its surface, each standing for a patch of it.
//
// Corner placement: the part's own surface is gathered into patches of at most a cell, apart where its
// normal turns by more than 20 degrees; each becomes a contact sphere that lies just under the surface and
// touches it there: its point on the surface is carried by the cell's trilinear weights, its normal by the
// cell's mean deformation gradient, n ~ F^-T N. Convex edges sharper than 30 degrees and their corners have
// points of their own. Centre placement: the outer elements themselves, balls that reach to the surface.
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/contact/points/contact_point.h"

namespace flexel::simulate {

// Points of the `parts` (parts) that are 1, by part, faces before edges before balls. `patches`: across a cell.
[[nodiscard]] std::vector<ContactPoint> contact_points(const Problem& problem,
                                                       const std::vector<std::uint8_t>& parts, int patches);

}  // namespace flexel::simulate
