// Surface -> Body: inside and outside, fill fractions, pieces, lattice.
#pragma once
#include "base/program/progress.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

// Voxelises every part of `surface`, which is moved into the body, its polygons turned outward (outward.h).
// Throws InputError: no size that fits the part (a spacing larger than it), nothing inside, memory beyond the
// limit (before allocating), moments at centre placement, two parts that are one body in one place.
[[nodiscard]] VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress);

}  // namespace flexel::voxelize
