// Quadrature over selected polygons: points on the part's surface at rest, each carried by the cell under it.
#pragma once
#include <vector>

#include "formats/body.h"
#include "formats/locate.h"

namespace flexel {

struct SurfacePoint {
  CellPoint at;
  Vec3 position = Vec3::Zero();     // m, rest, world frame
  Vec3 area_vector = Vec3::Zero();  // m^2, outward normal times the area that the point stands for
  std::uint32_t polygon = 0;
};

// Triangles are cut in two at their longest edge until that edge is at most 0.3 of the smallest spacing of
// their part; each piece gives its centroid. Points over no cell, or over a cell with skip[cell] != 0, are
// left out. Order: by polygon.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const Body& body,
                                                       const std::vector<std::uint32_t>& polygons,
                                                       const std::vector<std::uint8_t>& skip);

[[nodiscard]] double total_area(const std::vector<SurfacePoint>& points);

}  // namespace flexel
