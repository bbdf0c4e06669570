// Distances of samples from a surface, by OpenVDB; only sample_distances.cpp includes it.
#pragma once
#include <memory>
#include <string>

#include "formats/lattice/body.h"
#include "voxelize/classify/samples.h"

namespace flexel::voxelize {

// Distances from the samples to the nearest triangle, with the sign that OpenVDB's meshToVolume gives: what a
// flood from outside does not reach across the surface is inside, so that closed cavities count as matter and
// gaps of one or two samples close.
class SampleDistances {
 public:
  // `mesh` is placed on the lattice.
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

// Writes OpenVDB grids of a body with cells, two for each part: "fill_NAME", the fill of the voxels (index
// (i, j, k) is the voxel's centre, with the lattice's transform; pieces of one voxel add up), and
// "distance_NAME", a level set of the part's surface [m, negative inside] to three voxels from it, on cubic
// voxels of the lattice's least spacing with its axes and origin (the lattice's own transform where it is
// cubic). Inside is where the fill is a half or more. Throws InputError for a body without cells.
void write_vdb(const Body& body, const std::string& path);

}  // namespace flexel::voxelize
