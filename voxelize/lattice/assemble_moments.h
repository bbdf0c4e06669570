// Moments of pieces -> moments of the body's cells.
#pragma once
#include "formats/lattice/body.h"
#include "voxelize/classify/voxels.h"
#include "voxelize/lattice/assemble.h"

namespace flexel::voxelize {

// Appends those of the cells of the body's last part, which assemble_part made of `voxels`. Cells with less than
// the whole fill but without exact moments (a shell passes through itself there) get those of
// matter spread evenly: the fill times those of a whole cell; their number is returned.
// `slice`: which of the voxels became cells, and which of them are its own, where not all did.
std::size_t append_moments(const Voxels& voxels, Body& body, const PartSlice* slice = nullptr);

}  // namespace flexel::voxelize
