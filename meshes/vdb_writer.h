// Lattices as OpenVDB files.
#pragma once
#include "base/files/files.h"
#include "formats/lattice/body.h"

namespace flexel::meshes {

// The bytes of a file with OpenVDB grids of a body with cells, two for each part: "fill_NAME", the fill of the voxels (index
// (i, j, k) is the voxel's centre, with the lattice's transform; pieces of one voxel add up), and
// "distance_NAME", a level set of the part's surface [m, negative inside] to three voxels from it, on cubic
// voxels of the lattice's least spacing with its axes and origin (the lattice's own transform where it is
// cubic). Inside is where the fill is a half or more. Throws InputError for a body without cells.
[[nodiscard]] Bytes vdb_of(const Body& body);

}  // namespace flexel::meshes
