// Where a vertex sits in the lattice, before a frame is looked for.
#pragma once
#include "mapping/anchors/nearest.h"

namespace flexel::mapping {

// The element (or the cell and its corner) that becomes the origin of the vertex's frame, and the side of it
// that the vertex is on. Vertices with equal seats share one frame.
struct VertexAnchor {
  std::uint32_t owner = 0;  // cell or element
  bool in_cell = false;
  std::uint8_t octant =
      0;  // of a cell: its corner a = i + 2 j + 4 k; of an element: bits set on its high sides
};

constexpr double kHigher = 1e300;  // beyond every lattice

struct VertexAnchors {
  std::vector<VertexAnchor> seat;        // (vertices)
  std::vector<std::uint8_t> referenced;  // (vertices) 1: some polygon uses it
};

// At `element` of `part`, for a vertex at `point` (m). Half-way between two octants the side of `middle`
// (lattice coordinates) is taken, by default the higher one.
[[nodiscard]] VertexAnchor seat_at_element(const Body& body, std::uint32_t part, std::uint32_t element,
                                           const Vec3& point, const Vec3& middle = Vec3::Constant(kHigher));

// Throws InputError: no surface, a part without elements.
[[nodiscard]] VertexAnchors locate_vertices(const Body& body);

}  // namespace flexel::mapping
