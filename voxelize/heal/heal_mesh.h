// Repairs of a part's triangles: removal of duplicates and fins, welding.
#pragma once
#include <cstdint>
#include <vector>

#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// Leaves out repeated facets (the same three vertices): one of them stays where its edges need it to have an
// even number of triangles, none where they do not (a double membrane inside matter). Returns how many went.
std::size_t drop_duplicates(PartMesh& mesh);

// Joins vertices of open edges that lie within `tolerance` [m] of each other and leaves out triangles that
// collapse. Returns the number of open edges that this closed; where it closes none, the mesh stays.
std::size_t weld_open_edges(PartMesh& mesh, double tolerance);

// A sheet is left out only where it bounds less than this share of the volume, all such sheets together: the
// cones from the sheet's centroid to its triangles, which is nothing for a flat one and the content of an
// open cup.
constexpr double kNegligible = .02;

// Leaves out fins: sheets that hang on a closed surface by edges with an odd number of three or more
// triangles, which without them have an even number. Returns the number of triangles that went.
std::size_t drop_fins(PartMesh& mesh);

// Leaves out shells with open edges where what stays has none. Returns the number of triangles that went.
std::size_t drop_loose_sheets(PartMesh& mesh);

// Keeps the triangles marked 1, and the vertices that they use; numbers the edges anew.
void keep_triangles(PartMesh& mesh, const std::vector<std::uint8_t>& keep);

// In ascending order: the same for the same three vertices.
[[nodiscard]] Corners sorted_corners(Corners corners);

// Number of triangles at each edge (edges).
[[nodiscard]] std::vector<std::uint32_t> edge_degrees(const PartMesh& mesh);

}  // namespace flexel::voxelize
