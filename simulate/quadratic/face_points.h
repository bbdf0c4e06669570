// Points of the part's surface under which supports hold and loads act, each in the cell that its matter lies in.
#pragma once
#include <vector>

#include "simulate/quadratic/quadratic_nodes.h"

namespace flexel::simulate {

struct FacePoint {
  std::uint32_t cell = 0;        // index into QuadraticNodes::cells
  Vec3 at = Vec3::Zero();        // cell coordinates; beyond [0, 1] where the voxel's own matter was dropped
  Vec3 position = Vec3::Zero();  // m, rest, world frame
  Vec3 area_vector = Vec3::Zero();  // m^2, outward
};

// Of the selected polygons (simulate/matter/surface_points.h); none where no cell that resists lies under.
[[nodiscard]] std::vector<FacePoint> face_points(const Problem& problem, const QuadraticNodes& nodes,
                                                 const std::vector<std::uint32_t>& polygons);

// Shape functions at `at` of a cell, with gradients in the world frame [1/m].
[[nodiscard]] QuadraticShape world_shape(const Lattice& lattice, const Vec3& at);

}  // namespace flexel::simulate
