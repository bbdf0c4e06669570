// Elements at the lattice points around the pieces of matter: which pieces share an element.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"
#include "voxelize/classify/voxels.h"

namespace flexel::voxelize {

// Pieces with less fill are dropped: they become no cells, but matter still connects through them.
[[nodiscard]] inline bool has_cell(const Voxels& voxels, const Piece& piece) {
  return piece.fill >= voxels.dropped_fill;
}

// An element for every group of pieces around a lattice point that are connected through the faces incident
// to that point, at least one of them kept.
struct LatticeElements {
  std::vector<Index3> index;          // (elements x 3) sorted by (k, j, i, number)
  std::vector<std::uint16_t> number;  // (elements) distinguishes those of one lattice point, from 0
  std::vector<std::array<std::uint32_t, 8>> of_piece;  // (pieces x 8) element at each corner of the voxel;
                                                       // kNoElement where a dropped piece touches no kept one
};
constexpr std::uint32_t kNoElement = 0xffffffffu;
constexpr std::uint32_t kLeftOut = 0xfffffffeu;  // of a piece whose cell is not wanted

[[nodiscard]] LatticeElements make_elements(const Voxels& voxels);

// The same, with entries of `of_piece` for some pieces only: `number` has one entry for each piece, `first`
// to `first` + `count` - 1 for those wanted, in order, and kNoElement or kLeftOut for the others.
[[nodiscard]] LatticeElements make_elements(const Voxels& voxels, const std::vector<std::uint32_t>& number,
                                            std::uint32_t first, std::size_t count);

}  // namespace flexel::voxelize
