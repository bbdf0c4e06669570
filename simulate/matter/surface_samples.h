// Points of a part's surface at which its stress is looked for: the vertices, and where the lattice is finer than the
// surface's triangles points of the piece of a triangle in each voxel.
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/matter/voxel_pieces.h"

namespace flexel::simulate {

// Marks a polygon of which it is not known how much presses on it.
constexpr double kUnknownPressure = std::numeric_limits<double>::quiet_NaN();

// Polygons that turn by less than 30 degrees at a vertex are one smooth surface there; a vertex has a sample on each.
struct SurfaceSample {
  std::uint32_t cell = 0;    // of the body, whose matter lies under it
  std::uint32_t vertex = 0;  // of the surface: it is that, or the nearest of its triangle
  bool is_vertex = false;
  Vec3 at = Vec3::Zero();      // m, rest, world frame
  Vec3 normal = Vec3::Zero();  // outward, unit: the mean over the smooth surface around
  double pressure = 0;         // Pa, on the matter
};

// `pressure`: (polygons) [Pa], 0 where nothing acts. No sample where no cell lies under the surface, nor on polygons without
// area, nor outside of `range` (null: everywhere). In order of the vertices, then of the triangles.
[[nodiscard]] std::vector<SurfaceSample> surface_samples(const Body& body,
                                                         const std::vector<double>& pressure,
                                                         const VoxelRange* range = nullptr);

}  // namespace flexel::simulate
