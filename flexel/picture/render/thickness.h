// Wall thickness by rays.
#pragma once
#include "flexel/picture/render/drawable.h"

namespace flexel::picture {

// The length of the way from `position` against its outward `normal` through matter until the surface is met
// again, in the drawing's frame; NaN where it is not met.
[[nodiscard]] float thickness_at(const Tracer& tracer, const Vec3f& position, const Vec3f& normal);

// What the thickness ranges over, but for a hundredth of the drawable's area at either end; all zero where
// there is none.
struct ThicknessRange {
  float low = 0, largest = 0;
  // For colours: the largest, but at most 2.5 times the median by area: seen from its rim a plate is as thick
  // as it is wide.
  float high = 0;
};
[[nodiscard]] ThicknessRange thickness_range(const Drawable& drawn, const Tracer& tracer);

}  // namespace flexel::picture
