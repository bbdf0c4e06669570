// Consistent outward orientation of triangles.
#pragma once
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// Turns triangles over so that winding numbers are positive inside: triangles of a shell agree with their
// neighbours (each shell keeps the orientation that most of its area has), and shells that are outermost
// enclose positive volume. A shell inside another one may be inside out: it bounds a void.
void repair_orientation(PartMesh& mesh);

}  // namespace flexel::voxelize
