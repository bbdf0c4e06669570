// Anchors of vertices: where each vertex lies in the lattice.
#pragma once
#include <optional>

#include "formats/lattice/locate.h"
#include "mapping/anchors/nearest.h"

namespace flexel::mapping {

// The element (or cell corner) that becomes the origin of the vertex's frame, and the octant around it that
// the vertex is in. Vertices with equal anchors share one frame. Aligned so that threads can store it at once.
struct alignas(8) VertexAnchor {
  std::uint32_t owner = 0;  // cell or element
  bool in_cell = false;
  // Of a cell: its corner a = i + 2 j + 4 k. Of an element: bit 0, 1, 2 set on its high side along x, y, z.
  std::uint8_t octant = 0;
};

constexpr double kHigher = 1e300;  // beyond every lattice

struct VertexAnchors {
  std::vector<VertexAnchor> anchor;      // (vertices)
  std::vector<std::uint8_t> referenced;  // (vertices) 1: some polygon uses it
};

// At `element` of `part`, for a vertex at `point` (m). Half-way between two octants the side of `middle`
// (lattice coordinates) is taken, by default the higher one.
[[nodiscard]] VertexAnchor anchor_at_element(const Body& body, std::uint32_t part, std::uint32_t element,
                                             const Vec3& point, const Vec3& middle = Vec3::Constant(kHigher));

// `homes` (vertices, or empty): the part and the cell whose matter a vertex that no polygon uses is of, where known.
// Throws InputError: no surface, a part without elements.
[[nodiscard]] VertexAnchors locate_vertices(const Body& body,
                                            const std::vector<std::optional<PointHome>>& homes = {});

}  // namespace flexel::mapping
