// Sides of a part whose shape is not the one that its sides are named by, as of a part that `flexel compensate` makes: bent, it
// would have others.
#pragma once

namespace flexel::simulate {

// Column of a surface's vertices, 3 components, m: where they are in the shape that tells the sides ("xmin" ... "zmax"). Without it
// their own places do.
inline constexpr const char* kSidePlacesColumn = "flexel.side_places";

}  // namespace flexel::simulate
