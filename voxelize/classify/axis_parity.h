// Surface that is not closed -> voxels, by the parity of crossings along the three axes at samples.
#pragma once
#include <memory>

#include "voxelize/classify/samples.h"
#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// Along each axis a sample is inside when its line crosses the surface an odd number of times before it. An
// axis whose line has an odd number of crossings in all abstains; the majority of the axes decides. `mesh` is
// placed on the lattice.
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
