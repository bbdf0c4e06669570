// Moments of pieces -> moments of the body's cells.
#pragma once
#include "formats/lattice/body.h"
#include "voxelize/classify/voxels.h"

namespace flexel::voxelize {

// Appends those of the cells of the body's last part, which assemble_part made of `voxels`. Cells with less than
// the whole fill but without exact moments (shells overlap there, or the surface is not closed) get those of
// matter spread evenly: the fill times those of a whole cell.
void append_moments(const Voxels& voxels, Body& body);

}  // namespace flexel::voxelize
