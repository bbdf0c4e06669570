// Surface that is not closed -> voxels, by sampling.
#pragma once
#include <memory>

#include "voxelize/classify/samples.h"
#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// Along each axis a sample is inside when a line meets the surface an odd
// number of times before it; an axis whose line meets the surface an odd number of times in all abstains, and
// two axes that agree win. `mesh` is placed on the lattice.
class AxisVote {
 public:
  AxisVote(const PartMesh& mesh, const Range& range);
  ~AxisVote();
  [[nodiscard]] VoxelSamples samples(int i, int j, int k) const;

 private:
  struct Lines;
  Range range_;
  std::unique_ptr<Lines> lines_;
};

// Voxels by that vote; fill is the share of samples inside.
[[nodiscard]] Voxels classify_open(const PartMesh& mesh);

}  // namespace flexel::voxelize
