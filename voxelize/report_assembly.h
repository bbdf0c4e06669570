// The report on assemblies: one line for each kind of finding instead of one for each part.
#pragma once
#include "base/program/progress.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

// What walls thinner than a cell mean to a body with moments.
inline constexpr const char* kForQuadratic = "model quadratic carries them, model cells does not";

// Totals over the parts, and of what is wrong how many parts have it and the worst of them. All that is known
// of each part is in the summary (docs/reference/voxelize.md).
void report_together(const VoxelizeResult& result, Progress& progress);

// Parts that overlap, and parts that miss each other.
void report_pairs(const VoxelizeResult& result, Progress& progress);

}  // namespace flexel::voxelize
