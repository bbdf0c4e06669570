// Surface -> Body, of the matter in a box alone: what a closer look at a place of a part is taken with.
#pragma once
#include "formats/lattice/body.h"
#include "voxelize/heal/heal.h"

namespace flexel::voxelize {

// Heals a surface of one part once, and voxelises boxes of it.
class BoxVoxelizer {
 public:
  // Keeps a reference. Throws InputError: more than one part, the surface is not closed.
  BoxVoxelizer(const Surface& surface, const HealChoice& how);

  // The part in the voxels of a lattice with lower <= index < upper, with exact moments. The body has the whole surface, and surface_cells
  // only of polygons that pass through the box. Throws InputError: nothing of the part lies in the box.
  [[nodiscard]] Body operator()(const Lattice& lattice, const Index3& lower, const Index3& upper) const;

 private:
  const Surface& surface_;
  PartMesh mesh_;
};

}  // namespace flexel::voxelize
