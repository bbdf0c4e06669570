// How a part's cells and elements lie along the axis that it is cut across, counted block by block: the lattice is never
// there as a whole.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "voxelize/heal/heal.h"
#include "voxelize/lattice/assemble.h"

namespace flexel::voxelize {

struct PartLayers {
  int axis = 0;                       // with most layers; of several the last
  int first = 0;                      // lattice index of the first layer, and of the first plane
  std::vector<std::size_t> cells;     // (layers)
  std::vector<std::size_t> elements;  // (layers + 1) of the lattice planes across the axis
  std::vector<std::uint32_t>
      missing;  // polygons of HealedPart::original that no voxel's matter was cut by, ascending
};

struct Survey {
  AssembledPart found;
  PartLayers layers;
  std::size_t split_voxels = 0, undecided_voxels = 0, overlapping_voxels = 0;
};

// Of a closed part on its lattice. `dropped_fill`: as Voxels have it.
[[nodiscard]] Survey survey_layers(const HealedPart& part, double dropped_fill);

// Where the layers of piece r of `pieces` begin: at entry r, counted from PartLayers::first; they end at entry r + 1. As
// equal in cells as whole layers allow, with a cell in each; empty where there are fewer layers with cells than pieces.
[[nodiscard]] std::vector<std::size_t> cut_layers(const PartLayers& layers, std::size_t pieces);

}  // namespace flexel::voxelize
