// Points of the part's surface under which supports hold and loads act, each in the cell that its matter lies in.
#pragma once
#include <functional>
#include <vector>

#include "simulate/matter/voxel_pieces.h"
#include "simulate/quadratic/cells/quadratic_nodes.h"

namespace flexel::simulate {

struct FacePoint {
  std::uint32_t cell = 0;        // index into QuadraticNodes::cells
  Vec3 at = Vec3::Zero();        // cell coordinates; beyond [0, 1] where the voxel's own matter was dropped
  Vec3 position = Vec3::Zero();  // m, rest, world frame
  Vec3 area_vector = Vec3::Zero();  // m^2, outward
};

// Of the selected polygons: each is cut by the voxels, and each piece gets Gauss points; none where no cell that resists lies under.
// `range`: of the polygons only what lies there; null: all.
[[nodiscard]] std::vector<FacePoint> face_points(const Problem& problem, const QuadraticNodes& nodes,
                                                 const std::vector<std::uint32_t>& polygons,
                                                 const VoxelRange* range = nullptr);

// Gauss's points of a convex polygon (m, world frame), each with its share of the area vector. `small`: beside a voxel,
// where fewer do (is_small(), of the polygon in lattice coordinates).
void for_each_gauss_point(const Outline& polygon, bool small,
                          const std::function<void(const Vec3&, const Vec3&)>& use);
[[nodiscard]] bool is_small(const Outline& piece);

// The points, those in cells with little matter taken over by the next cell inwards (its polynomials reach a little
// further): there the traction of a field that hardly any matter resists would need any penalty to hold it.
[[nodiscard]] std::vector<FacePoint> in_firm_cells(const Body& body, const QuadraticNodes& nodes,
                                                   std::vector<FacePoint> points);

// Shape functions at `at` of a cell, with gradients in the world frame [1/m].
[[nodiscard]] QuadraticShape world_shape(const Lattice& lattice, const Vec3& at);

}  // namespace flexel::simulate
