// The search for four close elements that span a well-conditioned base.
#pragma once
#include <optional>

#include "mapping/anchors/frame.h"

namespace flexel::mapping {

// The largest distance of a frame's elements from its origin, in connections. A plane or a line through near
// elements describes the motion at the vertex better than farther ones.
constexpr int kRings = 3;

// The frame with origin `origin` for a vertex in `octant` of it (bit 0, 1, 2: on the high side along the
// lattice's x, y, z of `part`). Elements are looked for along `connections` only, ring by ring, nearest to
// the middle of the octant first. Where no three of them span space the frame is a plane, a line or rigid.
[[nodiscard]] Frame find_frame(const Body& body, const Adjacency& connections, const Part& part,
                               std::uint32_t origin, int octant);

// The frame of three edges of one cell that leave its corner `corner`: what nearly every vertex of a corner
// placement has. Nothing when the cell is broken or its elements at rest are ill-conditioned.
[[nodiscard]] std::optional<Frame> cell_frame(const Body& body, std::uint32_t cell, int corner);

}  // namespace flexel::mapping
