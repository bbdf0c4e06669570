// Where the planes of a coarser lattice lie (simulate/estimate/coarsen.h).
#pragma once
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

// Pairs of cells that share a face, the lower one first, by axis and ascending; none of broken cells.
using FacePairs = std::array<std::vector<std::array<std::uint32_t, 2>>, 3>;
[[nodiscard]] FacePairs face_pairs(const Body& body);

// Coarse planes of one axis at begin + k pitch, in fine spacings.
struct CoarseGrid {
  double begin = 0, pitch = 2;
};

// A cell of the fine lattice at `index` along one axis: the coarse voxels that it overlaps (`voxel` and,
// where `count` is 2, the next), and how much of it lies in each.
struct GridCut {
  std::int32_t voxel = 0;
  std::uint32_t count = 1;
  std::array<double, 2> share{1, 0};
};
[[nodiscard]] GridCut cut(const CoarseGrid& grid, std::int32_t index);

// By axis, moved so that the first coarse plane at or below all cells has index 0; of a body in pieces those of the whole. The pitch is 2 unless
// another from 1.5 to 3 puts more flat faces of the part on planes; where the axis along which the part is
// thinnest takes less, the others come near to that. Throws InputError: a part one cell thick. `doubled`, for a body with
// moments: the pitch is 2 everywhere, from a plane of its own: no cell is cut, for what of its moments lies on either side of a cut is
// not known.
[[nodiscard]] std::array<CoarseGrid, 3> choose_grids(const Body& body, const Part& part,
                                                     const FacePairs& pairs, bool doubled);

}  // namespace flexel::simulate
