// Which vertices of a surface are one place, with the tolerance of the healer.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/part/surface.h"

namespace flexel {

// (vertices) the representative of each: the first of its part at exactly its position, or where edges are open the
// first within 1e-7 of the part's diagonal, which is how far seams in files of single precision come apart. No vertex
// moves.
[[nodiscard]] std::vector<std::uint32_t> weld_parts(const Surface& surface, const Triangles& triangles);

// (triangles) bit i: the edge from corner i to the next is not shared by two triangles, so that what lies across it may
// be split elsewhere: a border, a T-junction.
[[nodiscard]] std::vector<std::uint8_t> unshared_edges(const Surface& surface, const Triangles& triangles);

}  // namespace flexel
