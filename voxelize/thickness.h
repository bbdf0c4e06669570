// Wall thickness at each vertex of a part's surface.
#pragma once
#include <vector>

#include "formats/part/surface.h"

namespace flexel::voxelize {

// Wall thickness [m] at every vertex (vertices): the shortest ray, along the inward normals of the triangles
// at the vertex, to where it leaves the matter; exact for the mesh. Rays that end on a facet opposing them
// within 30 degrees go first; where there is none (a cone's tip), the shortest of all counts. Rays start a
// twentieth inside their triangle, to miss the faces at its edges. Surfaces are healed as by `--heal auto`;
// NaN where a vertex is in no triangle or every ray misses.
[[nodiscard]] std::vector<double> vertex_thickness(const Surface& surface);

}  // namespace flexel::voxelize
