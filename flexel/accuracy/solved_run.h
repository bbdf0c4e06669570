// One run at one size.
#pragma once
#include <string>
#include <vector>

#include "base/math/vec.h"
#include "simulate/result/result.h"
#include "voxelize/types/result.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {

// One run at one size, its body deformed.
struct SolvedRun {
  double size = 0;  // m, asked for
  voxelize::VoxelizeResult voxels;
  simulate::SimulateResult simulated;
  std::vector<Vec3> mapped;  // (vertices) m
  double voxelize_seconds = 0, map_seconds = 0;
  double processor_seconds = 0;       // of all of it and all threads; 0: not known
  double wall = 1e300;                // m: a fifth of the matter lies in thinner walls
  std::vector<std::string> warnings;  // said while it ran, held back
  bool given_up = false;
};

}  // namespace flexel::commands
