// Distances of samples from a surface, by OpenVDB.
#pragma once
#include <array>
#include <memory>

#include "voxelize/classify/samples.h"

namespace flexel::voxelize {

// Distances from the samples to the nearest triangle, with the sign that OpenVDB's meshToVolume gives: what a
// flood from outside does not reach across the surface is inside, so that closed cavities count as matter and
// gaps of one or two samples close.
class SampleDistances {
 public:
  // `mesh` is placed on the lattice. Throws InputError: the module with OpenVDB is not there.
  SampleDistances(const PartMesh& mesh, const Range& range);
  ~SampleDistances();
  static constexpr float kBand = 3;  // samples: distances beyond are cut off here
  // Distance of sample (x, y, z), counted from the range's first, in samples; negative inside.
  [[nodiscard]] float at(int x, int y, int z) const;
  // The same for the 64 samples of voxel (i, j, k), bit order of VoxelSamples.
  void voxel(int i, int j, int k, std::array<float, 64>& out) const;

 private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
};

}  // namespace flexel::voxelize
