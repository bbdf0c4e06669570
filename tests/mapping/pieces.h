// What the tests of cracks share: bodies that are broken, and what is expected of their pieces.
#pragma once
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "bodies.h"
#include "mapping/map_part.h"

namespace flexel::mapping::test {

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // of two vertices

// One part of a surface, by index.
struct Piece {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::vector<std::uint32_t>> polygons;
};
std::vector<Piece> pieces_of(const Surface& surface);

// Vertices less edges plus faces.
int euler(const Piece& piece);
double volume_of(const Surface& surface);

// Breaks the cells whose middle is in `broken`.
void break_cells(Body& body, const Solid& broken);
MappedPart map_broken(Body& body, CrackMode mode, bool drop_debris = false);

// Every piece is closed, manifold and positive, CGAL agrees, and together they are the whole.
void expect_whole(const Body& body, const MappedPart& mapped);

// A ball of radius 0.5 about 0, and its surface of quads and triangles; `hole`: radius of a hollow.
Body ball(Placement placement, const Mat3& axes, double hole = 0);

}  // namespace flexel::mapping::test
