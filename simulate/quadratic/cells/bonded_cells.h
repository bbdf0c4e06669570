// Cells of different parts that meet on a common surface, with points of it.
#pragma once
#include <array>
#include <vector>

#include "simulate/quadratic/cells/face_points.h"

namespace flexel::simulate {

struct BondedCells {
  std::array<std::uint32_t, 2> cell{};  // index into QuadraticNodes::cells
  // (points of the common surface) of either cell, the same places; area vectors point out of each
  std::array<std::vector<FacePoint>, 2> points;
};

struct CommonSurface {
  std::vector<BondedCells> pairs;       // ascending by cells
  std::vector<std::uint32_t> polygons;  // of either part, that have a share in it, ascending
  double area = 0;                      // m^2
};

// Of two parts: where a facet of one faces one of the other within 45 degrees, at most `gap` [m] away, or 1e-6 of the body's
// diagonal, or .01 of the finer spacing. Facets are cut by one another, then by the voxels of both lattices, so that
// Gauss's points integrate the shape functions of both exactly.
[[nodiscard]] CommonSurface common_surface(const Problem& problem, const QuadraticNodes& nodes,
                                           const std::array<std::uint32_t, 2>& parts, double gap);

}  // namespace flexel::simulate
