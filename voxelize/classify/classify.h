// Closed surface -> voxels: fill fractions and pieces, exact to rounding.
#pragma once
#include <optional>

#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

struct ClassifyOptions {
  bool with_centres = false;  // set kContainsCentre
  bool with_moments = false;  // set Slab::moments
  // These voxels alone, each as it would be among all; and what is counted of a slab, of these alone.
  std::optional<VoxelBox> box = {}, counted = {};
};

// `mesh` is balanced, oriented and placed on the lattice. Voxels whose corners lie in several shells, or in
// which shells intersect, get their fill from lines (overlap.h) and are one piece; they have no moments then.
[[nodiscard]] Voxels classify_closed(const PartMesh& mesh, const ClassifyOptions& options);

}  // namespace flexel::voxelize
