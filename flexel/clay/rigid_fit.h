// The rigid motion nearest to that of some points.
#pragma once
#include <vector>

#include "flexel/clay/tool_pose.h"

namespace flexel::clay {

struct MovedPoint {
  Vec3 rest = Vec3::Zero(), displacement = Vec3::Zero();  // m
};

// By least squares (Kabsch 1976), about their mean at rest. No turn where the points lie on a line.
[[nodiscard]] ToolPose rigid_fit(const std::vector<MovedPoint>& points);
[[nodiscard]] Vec3 mean_rest(const std::vector<MovedPoint>& points);

}  // namespace flexel::clay
