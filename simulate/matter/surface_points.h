// Quadrature over selected polygons: points on the part's surface at rest, each carried by the cell under it,
// or by the nearest element (centre placement).
#pragma once
#include <vector>

#include "simulate/matter/interpolation_weights.h"

namespace flexel::simulate {

struct SurfacePoint {
  InterpolationWeights at;
  Vec3 position = Vec3::Zero();     // m, rest, world frame
  Vec3 area_vector = Vec3::Zero();  // m^2, outward normal times the area that the point stands for
  std::uint32_t polygon = 0;
};

// Triangles are cut in two at their longest edge until that edge is at most 0.3 of the smallest spacing of
// their part; each piece gives its centroid. Points that nothing carries, or only stray matter, are left out.
// Order: by polygon.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const Problem& problem,
                                                       const std::vector<std::uint32_t>& polygons);

// The same of some of the surface's triangles (numbers in `triangles`), for many calls on one surface.
[[nodiscard]] std::vector<SurfacePoint> surface_points(const Problem& problem, const Triangles& triangles,
                                                       const std::vector<std::uint32_t>& chosen);

// The same quadrature in few points, for what is linear in position and weights: of the points that one cell
// (one element) carries within a piece of a polygon of some ten spacings, the mean by area. Sums of area, of
// area times position and of area times weights stay as they are. At centre placement a point equally near to several
// elements goes with all of them by equal shares, so that rounding, as of another origin, decides nothing.
[[nodiscard]] std::vector<SurfacePoint> gathered_surface_points(const Problem& problem,
                                                                const std::vector<std::uint32_t>& polygons);

// Of these, points at centre placement that are equally near to several elements go with all of them by equal shares too.
[[nodiscard]] std::vector<SurfacePoint> shared_evenly(const Problem& problem,
                                                      std::vector<SurfacePoint> points);

// How many points the surface of each part has, (parts), those that nothing carries among them: for what they will take.
[[nodiscard]] std::vector<std::size_t> surface_point_counts(const Body& body);

[[nodiscard]] double total_area(const std::vector<SurfacePoint>& points);

}  // namespace flexel::simulate
