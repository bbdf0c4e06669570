// How thick a part is under each vertex of its surface.
#pragma once
#include <vector>

#include "formats/part/surface.h"

namespace flexel::voxelize {

// Wall thickness [m] at every vertex (vertices): the least of the ways, along the inward normals of the
// triangles at the vertex, to where matter ends; exact for the triangles as they are. A way counts where it
// ends on a facet that opposes it within 30 degrees; where none does (a cone's tip), the least of all ways.
// Rays start a twentieth inside the triangle, so that the sides of an edge do not count. Surfaces are healed
// as `--heal auto` does; NaN where a vertex is in no triangle or every way misses.
[[nodiscard]] std::vector<double> vertex_thickness(const Surface& surface);

}  // namespace flexel::voxelize
