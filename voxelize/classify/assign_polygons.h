// Which pieces of matter lie under the polygons of a surface that the classification did not cut itself.
#pragma once
#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// Adds traces for the polygons of `mesh` (placed on the lattice) that `voxels` has none for: in every voxel
// that a triangle passes through the piece that lies nearest to it (with samples; else the fullest), or where
// the voxel is empty the fullest piece of the 26 around.
void trace_missing(const PartMesh& mesh, Voxels& voxels);

// Adds those of certain polygons (ascending).
void trace_polygons(const PartMesh& mesh, const std::vector<std::uint32_t>& polygons, Voxels& voxels);

}  // namespace flexel::voxelize
