// Axis-parallel lines through a mesh: where they enter and leave it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// A grid of lines along `axis`. With (u, v, axis) a cyclic permutation of (x, y, z), line (a, b) runs at
// u = u_begin + a u_step, v = v_begin + b v_step.
struct LineGrid {
  int axis = 2;
  double u_begin = 0, v_begin = 0, u_step = 1, v_step = 1;
  int u_count = 1, v_count = 1;
};

struct LineCrossing {
  std::uint32_t line = 0;   // a + u_count b
  std::int32_t change = 0;  // of the winding number going along +axis: +1 entering, -1 leaving
  double at = 0;            // coordinate along the axis
  std::uint32_t triangle = 0;
};

// Every crossing of the lines with the triangles listed (all when empty), sorted by (line, at, triangle).
// `points` holds the mesh's vertices in the frame of the grid. Neighbouring triangles agree on which side of
// their edge a line passes, so a line crosses a closed mesh an even number of times, entering as often as it
// leaves.
[[nodiscard]] std::vector<LineCrossing> cross_lines(const PartMesh& mesh, const std::vector<Vec3>& points,
                                                    const LineGrid& grid,
                                                    std::span<const std::uint32_t> triangles = {});

}  // namespace flexel::voxelize
