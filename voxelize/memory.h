// Estimates of cells and memory before a lattice is made.
#pragma once
#include "formats/lattice/body.h"

namespace flexel::voxelize {

// Size of a part, for estimates.
struct PartExtent {
  double volume = 0;  // m^3
  double area = 0;    // m^2 of its surface
};

// Cells (centre placement: elements) of a part at spacing h [m]. A lattice plane at a random place and
// orientation cuts 3/2 A / h^2 voxels of a smooth surface of area A (mean of |n_x| + |n_y| + |n_z| over
// directions); half the volume of those is inside already: V / h^3 + 3/4 A / h^2 (corners), V / h^3
// (centres).
[[nodiscard]] double estimate_cells(const PartExtent& extent, double spacing, Placement placement);

// The spacing [m] at which all parts together have `cells` cells.
[[nodiscard]] double spacing_for_cells(const std::vector<PartExtent>& extents, double cells,
                                       Placement placement);

// Bytes that simulate needs at equilibrium: 35 MB for the program and, for corner placement, 4.5 kB a cell:
// about one element a cell, 27 blocks of 3 x 3 doubles (72 B) each in the assembled matrix = 1.9 kB, about as
// much again for the multigrid hierarchy, the rest vectors. Measured peaks lie at 0.85 to 0.95 of it, on a
// solid block and a thin plate of 20,000 to 130,000 cells. Centre placement: 4.2 kB an element, which has as
// many neighbours; measured peaks lie at 0.90 to 0.95 of it, on a solid block of 32,000 to 500,000 elements.
// With `moments`, for model `quadratic`: 36 kB a cell (moments, turned cells, Schwarz blocks, and every cell's matrix in
// single precision while the blocks are made); measured peaks lie at 0.79 to 1.18 of it, 4,000 to 34,000 cells.
[[nodiscard]] double simulation_memory(double cells, Placement placement, bool moments);

// The cells (centre placement: elements) that simulate can hold in so many bytes, at least 1.
[[nodiscard]] double cells_within(double bytes, Placement placement, bool moments);

}  // namespace flexel::voxelize
