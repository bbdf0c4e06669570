// Voxels made of 4 x 4 x 4 samples each, for surfaces that are not closed.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

constexpr int kSamples = 4;  // along each side of a voxel

// Whole voxels around the mesh, which is placed on the lattice.
struct Range {
  std::array<int, 3> begin{}, count{};
  [[nodiscard]] std::size_t voxels() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
           static_cast<std::size_t>(count[2]);
  }
};
[[nodiscard]] Range voxel_range(const PartMesh& mesh);

// The samples of one voxel: bit x + 4 y + 16 z set where the sample (x + 1/2, y + 1/2, z + 1/2) / 4 is
// inside.
struct VoxelSamples {
  std::uint64_t inside = 0;
  double fill = -1;     // share of the voxel, where it is known better than by counting samples
  bool differ = false;  // those who judged did not agree
};
// Samples of voxel (i, j, k), counted from the range's begin; called from several threads.
using SampleSource = std::function<VoxelSamples(int i, int j, int k)>;

// Pieces are samples connected through their six neighbours. Polygons are not traced yet.
[[nodiscard]] Voxels voxels_from_samples(const Range& range, const SampleSource& source);

}  // namespace flexel::voxelize
