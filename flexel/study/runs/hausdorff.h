// The Hausdorff distance of two surfaces, over all points of their triangles.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "base/math/vec.h"

namespace flexel::study {

// The Hausdorff distance of two surfaces that share their triangles and differ in their vertices:
//     max( max over p on A of d(p, B), max over q on B of d(q, A) ).
// Never less than the true value, and at most kHausdorffMargin above it unless more than 100,000 pieces a
// side, or more time than until `deadline`, were needed; the result is then the upper bound reached. Branch
// and bound over pieces of triangles (Tang, Lee, Kim 2009, "Interactive Hausdorff distance computation for
// general polygonal models", ACM Trans. Graph. 28). a, b: (vertices) m; triangles: indices into both. 0
// without triangles.
inline constexpr double kHausdorffMargin = 0.05;
[[nodiscard]] double hausdorff_distance(
    std::span<const Vec3> a, std::span<const Vec3> b, std::span<const std::array<std::uint32_t, 3>> triangles,
    std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max());

}  // namespace flexel::study
