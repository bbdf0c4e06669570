// coarsened() of a body in pieces (formats/pieces/other_pieces.h).
#pragma once
#include "formats/lattice/body.h"

namespace flexel::simulate {

// Each process coarsens its own cells, and the first joins what all made: it has the coarse body, an eighth of the cells, and the others
// have none. As coarsened() of the whole makes it, but for the order of cells in one voxel, and without moments. Of all processes
// together; all throw what coarsened() throws.
[[nodiscard]] Body coarsened_from_pieces(const Body& body);

// Whether any piece has moments: the planes of coarser lattices keep off the cells then. Of all processes together.
[[nodiscard]] bool have_moments(const Body& body);

}  // namespace flexel::simulate
