// The report on voxelised parts, as text and as JSON.
#pragma once
#include <string>

#include "base/program/progress.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

// Says what was found, a few lines a part.
void report(const VoxelizeResult& result, Progress& progress);
// The same as JSON, in SI units (docs/reference/voxelize.md).
[[nodiscard]] std::string summary_json(const VoxelizeResult& result);

}  // namespace flexel::voxelize
