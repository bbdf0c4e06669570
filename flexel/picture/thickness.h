// Wall thickness by rays.
#pragma once
#include "flexel/picture/drawable.h"

namespace flexel {

// The length of the way from `position` against its outward `normal` through matter until the surface is met
// again, in the drawing's frame; NaN where it is not met.
[[nodiscard]] float thickness_at(const Tracer& tracer, const Vec3f& position, const Vec3f& normal);

// The shortest and longest thickness of the drawable but for a hundredth of its area at either end; {0, 0}
// where there is none.
struct ThicknessRange {
  float low = 0, high = 0;
};
[[nodiscard]] ThicknessRange thickness_range(const Drawable& drawn, const Tracer& tracer);

}  // namespace flexel
