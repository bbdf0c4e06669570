// Surface that is not closed -> voxels, by sampling.
#pragma once
#include "voxelize/part_mesh.h"
#include "voxelize/voxels.h"

namespace flexel {

// Every voxel has 4 x 4 x 4 samples. Along each axis a sample is inside when a line meets the surface an odd
// number of times before it; an axis whose line meets the surface an odd number of times in all abstains, and
// two axes that agree win. Fill is the share of samples inside; pieces are samples connected through their
// six neighbours. `mesh` is placed on the lattice.
[[nodiscard]] Voxels classify_open(const PartMesh& mesh);

}  // namespace flexel
