// The vertices grouped by anchor cell, each group with the elements that may carry it. `blended` and `smooth`
// work through them block by block, so that an element's data is fetched once for all vertices around it.
#pragma once
#include "mapping/anchors/connected_neighbourhood.h"
#include "mapping/anchors/vertex_anchor.h"

namespace flexel::mapping {

// Vertices of one cell (corner placement), or nearest to one element (centre placement; broken cells, whose
// matter stays with its nearest element).
struct Group {
  std::uint32_t owner = 0;  // cell or element
  bool in_cell = false;
  std::uint32_t part = 0;
  Index3 home{};                     // lattice index of the cell's lowest corner, or of the element
  std::uint32_t begin = 0, end = 0;  // of Groups::vertices
  std::uint64_t reach_begin = 0, reach_end = 0;  // of Groups::elements
};

struct Groups {
  // Vertices of one group, at most kBlock of them: the unit of work.
  struct Block {
    std::uint32_t group = 0, begin = 0, end = 0;
  };
  static constexpr std::uint32_t kBlock = 256;

  std::vector<std::uint32_t> vertices;  // by group, ascending within one
  std::vector<Group> groups;
  std::vector<Block> blocks;
  // By group: the elements that may carry its vertices (mapping/anchors/connected_neighbourhood.h)
  std::vector<std::uint32_t> elements;
  std::vector<std::uint8_t> from;  // (elements) the corners of the cell that reach it; 1 for element groups
};

// Elements farther than `radius` spacings from the cell have no weight at its vertices and are left out;
// those of an element group all stay.
[[nodiscard]] Groups group_vertices(const Body& body, const Adjacency& connections,
                                    const std::vector<VertexAnchor>& anchors, int steps, double radius);

// Where `point` lies as seen from the group, in spacings: a cell's corners are at 0 and 1.
[[nodiscard]] inline Vec3 within(const Body& body, const Group& group, const Vec3& point) {
  const Part& part = body.parts[group.part];
  const Vec3 u = part.lattice.to_lattice(point) - Vec3(group.home[0], group.home[1], group.home[2]);
  return part.placement == Placement::centre ? Vec3(u - Vec3::Constant(0.5)) : u;
}

// Where element `element` lies as seen from the group, in spacings.
[[nodiscard]] inline Vec3 offset(const Body& body, const Group& group, std::uint32_t element) {
  const Index3& index = body.lattice_index[element];
  return Vec3(index[0], index[1], index[2]) - Vec3(group.home[0], group.home[1], group.home[2]);
}

// The weight of each anchor for a point at `within` of the group (blend_weights.h).
[[nodiscard]] std::array<double, 8> shares(const Group& group, const Vec3& within);

}  // namespace flexel::mapping
