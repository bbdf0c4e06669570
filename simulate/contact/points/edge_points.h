// Contact points of sharp convex edges: the patches of a face begin a quarter of a cell from its rim, so a body
// that stands on an edge or a corner needs points there. They have no plane of their own (contact is along the
// normal of the other side), only a cone of directions in which they are the outermost matter of the body.
#pragma once
#include "simulate/contact/points/contact_points.h"

namespace flexel::simulate {

// Of the corner-placed ones of the `parts` (parts) that are 1: convex edges of more than 30 degrees, at most
// half a spacing from one another, and their corners.
[[nodiscard]] std::vector<ContactPoint> edge_points(const Problem& problem,
                                                    const std::vector<std::uint8_t>& parts);

}  // namespace flexel::simulate
