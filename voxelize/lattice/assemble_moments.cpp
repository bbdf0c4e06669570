// One pass over the pieces in the order of the cells: what takes time was done slab by slab.
#include "voxelize/lattice/assemble_moments.h"

#include "voxelize/lattice/elements.h"

namespace flexel::voxelize {
namespace {

void append(const CellMoments& moments, double scale, std::uint32_t cell, Body& body) {
  body.moment_cells.push_back(cell);
  for (const double moment : moments) body.moments.push_back(scale * moment);
}

}  // namespace

std::size_t append_moments(const Voxels& voxels, Body& body, const PartSlice* slice) {
  constexpr CellMoments kWhole = whole_moments();
  std::uint32_t cell = body.parts.back().cell_begin;
  std::size_t spread = 0;
  for (std::size_t s = 0; s < voxels.slabs.size(); ++s) {
    const Slab& slab = voxels.slabs[s];
    const int k = voxels.k_begin + static_cast<int>(s);
    std::size_t next = 0;
    int j = slab.j_begin;
    for (std::uint32_t p = 0; p < slab.pieces.size(); ++p) {
      while (slab.row_begin[j - slab.j_begin + 1] <= p) ++j;
      const bool exact = next < slab.moment_pieces.size() && slab.moment_pieces[next] == p;
      const int i = slab.pieces[p].i;
      if (has_cell(voxels, slab.pieces[p]) && (slice == nullptr || slice->held.holds(i, j, k))) {
        if (exact)
          append(slab.moments[next], 1, cell, body);
        else if (slab.pieces[p].fill < kWholeFill) {
          append(kWhole, slab.pieces[p].fill, cell, body);
          spread += slice == nullptr || slice->own.holds(i, j, k);
        }
        ++cell;
      }
      next += exact;
    }
  }
  return spread;
}

}  // namespace flexel::voxelize
