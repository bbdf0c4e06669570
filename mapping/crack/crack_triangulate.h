// Triangles inside closed loops in a plane.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace flexel::mapping {

// The part of the plane that an odd number of `edges` (pairs of points that together close loops) divides
// from the outside, as triangles of the points, counter-clockwise: constrained Delaunay (CGAL), which adds no
// points. Nothing when two points coincide, or edges cross or run over points.
[[nodiscard]] std::optional<std::vector<std::array<std::uint32_t, 3>>> triangulate_inside(
    const std::vector<Eigen::Vector2d>& points, const std::vector<std::array<std::uint32_t, 2>>& edges);

}  // namespace flexel::mapping
