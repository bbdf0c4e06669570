// The same matter on a coarser lattice: what error bars compare a result with (docs/theory/error-bars.md).
//
// Each part's lattice becomes about twice as coarse along each axis. A cell of the finer lattice gives its
// matter to the coarse voxels that it overlaps; the fill is what they got. What is not connected through the
// faces of fine cells stays apart: a coarse voxel has a cell a connected piece in it, and coarse elements are
// shared only where the matter on both sides of a coarse face meets there.
//
// The spacing is exactly doubled unless another one between 1.5 and 3 times puts more of the flat faces of
// the part, which lie on planes of the fine lattice, on planes of the coarse one: a wall of three cells
// becomes one of two, not one of one and a half. With moments it is exactly doubled, and the coarse cells that are
// not whole get moments in turn, exact as theirs.
#pragma once
#include "formats/lattice/body.h"
#include "simulate/estimate/coarse_grid.h"

namespace flexel::simulate {

// At rest, without columns and without the source bytes of the surface. Throws InputError with the reason
// where the body cannot be coarsened: centre placement, a part one cell thick (without moments), columns of an earlier run.
[[nodiscard]] Body coarsened(const Body& body);

// Likewise, with the coarse cells that each fine one overlaps.
struct Coarsening {
  Body body;
  std::vector<std::uint32_t> offsets, cells;  // of fine cell c: cells[offsets[c]] to cells[offsets[c + 1]]
};
[[nodiscard]] Coarsening coarsening(const Body& body);
// On these planes, of a body with one part. The coarse cells of a fine one come in the order of its places in the cuts along x, y
// and z, x fastest.
[[nodiscard]] Coarsening coarsening(const Body& body, const std::array<CoarseGrid, 3>& grids);
// Throws where coarsened() does, but for a part one cell thick.
void refuse_to_coarsen(const Body& body);
// Appends the cells under the next polygon, which `under` may name in any order and twice.
void append_cells_under(std::vector<std::uint32_t>& under, Body& coarse);
// What a coarse body has besides parts, elements, cells and those under polygons: it is at rest and whole, on `surface` without the
// bytes of its source.
void complete_at_rest(const Surface& surface, Body& coarse);

// (elements) m: how far the matter under each element of `fine` has moved on the coarse body, trilinear in
// the coarse cell that holds the element; zero for elements of broken cells alone.
[[nodiscard]] std::vector<Vec3> prolonged_displacement(const Coarsening& coarse, const Body& fine);

// Share of the matter in walls under `cells` cells: the least, over the lattice's axes, of the matter in the
// row of cells through a cell. Corner placement.
[[nodiscard]] double share_of_thin_walls(const Body& body, double cells);

}  // namespace flexel::simulate
