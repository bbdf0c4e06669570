// What the page draws of a part or of a lattice.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::view {

// Triangles that share a point where the surface is smooth, and have one each at a crease. Where the triangles have values
// of their own they share none; normals are smooth all the same, by `smooth`.
struct Shape {
  std::vector<Vec3> rest;                               // (points x 3) m, world frame
  std::vector<std::uint32_t> source;                    // (points) vertex of the surface, or element
  std::vector<std::uint32_t> owner;                     // (points) a polygon or cell that it is a corner of
  std::vector<std::uint32_t> smooth;                    // (points) those with one number have one normal
  std::vector<std::array<std::uint32_t, 3>> triangles;  // (triangles x 3) points
  std::vector<std::uint32_t> face;  // (triangles) index into Surface::faces; a lattice: part
  std::vector<std::array<std::uint32_t, 2>> creases,
      borders;  // lines between points; picture/render/drawable.h
};

// `by_polygon`: polygons have values of their own.
[[nodiscard]] Shape surface_shape(const Surface& surface, bool by_polygon);

// The hull of the cells that are not broken. A body without cells gives an empty shape.
[[nodiscard]] Shape lattice_shape(const Body& body);

}  // namespace flexel::view
