// Bodies made in the test: lattices of implicit solids and the surfaces around them, without the voxeliser.
#pragma once
#include <functional>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::mapping::test {

using Solid = std::function<bool(const Vec3&)>;  // world point -> inside
using Field = std::function<Vec3(const Vec3&)>;  // rest point -> deformed point

// A body of one part: cells (corner) or elements (centre) of the voxels of `lattice` whose centre is inside
// `solid`; voxels from `low` to below `high`. No surface yet.
Body make_body(const Lattice& lattice, const Index3& low, const Index3& high, const Solid& solid,
               Placement placement);

// Appends the elements, cells and surface of `other`.
void append_body(Body& body, const Body& other);

// Adds polygons to the last part of the body (face "face"); vertices are appended.
void add_surface(Body& body, const std::vector<Vec3>& vertices,
                 const std::vector<std::vector<std::uint32_t>>& polygons);

// Fills surface_cells: every polygon gets the cells nearest to its corners and its middle (enough where
// polygons are smaller than voxels).
void derive_surface_cells(Body& body);

// A box [low, high] of quads in a grid of n x n a side, and a tube about the x axis from x = 0 to `length`.
void add_box_surface(Body& body, const Vec3& low, const Vec3& high, int n);
void add_tube_surface(Body& body, double length, double radius, int along, int around);

// The whole lattice of nx x ny x nz voxels from the origin, spacing h, with a box surface just inside its
// outside.
Body block(int nx, int ny, int nz, double h, Placement placement, int n = 8);

void deform(Body& body, const Field& field);
Mat3 rotation(double angle, const Vec3& axis);

}  // namespace flexel::mapping::test
