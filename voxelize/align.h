// Where the lattice of a part lies.
#pragma once
#include "voxelize/part_mesh.h"
#include "voxelize/voxelize.h"

namespace flexel {

// A lattice of about spacing `size` [m] for the part.
// none: world axes, cubic, origin at the lowest corner of the bounding box.
// box: world axes, spacing per axis such that the bounding box is whole cells.
// snap: turned and shifted to the part's dominant flat faces; see align.cpp.
// `cubic` keeps the spacing equal along all axes (elements at voxel centres).
[[nodiscard]] Lattice align_lattice(const PartMesh& mesh, double size, Align align, bool cubic);

}  // namespace flexel
