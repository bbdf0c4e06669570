// Where shells interpenetrate: fills and volumes of their union.
#pragma once
#include "formats/lattice/cell_moments.h"
#include "voxelize/classify/pieces.h"

namespace flexel::voxelize {

struct LineFill {
  double fill = 0;        // share of the voxel where the winding number is above 0
  bool overlap = false;   // a winding number other than 0 and 1 was met
  CellMoments moments{};  // of what is counted in `fill`
};

// By 64 x 64 lines through the voxel, exact along each line; each line stands for the square around it.
[[nodiscard]] LineFill fill_by_lines(const VoxelRecords& voxel);

// Volume [m^3] of the part where the winding number is above 0, by `lines` x `lines` lines along each axis
// (their mean).
[[nodiscard]] double union_volume(const PartMesh& mesh, int lines = 512);

}  // namespace flexel::voxelize
