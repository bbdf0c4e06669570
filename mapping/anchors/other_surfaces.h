// Mapping what did not come with the body: any other surface in the part's frame, and points.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::mapping {

// Puts the vertices and polygons of `surface` in the place of the body's own. Each of its parts goes with the
// body's part of the same name or, where there is none, the one whose elements are nearest to its vertices on
// the whole. The surface itself stays as it is, for writing. Throws InputError: a part of the body without
// elements.
void map_onto(Body& body, const Surface& surface);

// A table of points, as text: x, y, z by the names in a header line, else the first three columns.
struct PointTable {
  std::vector<std::string> lines;       // of the file, without line ends
  std::vector<std::size_t> line;        // (points) which line each stands in
  std::array<std::size_t, 3> column{};  // of x, y, z
  std::vector<Vec3> points;             // m
};
// `unit`: metres per unit of the numbers. Separators: comma, semicolon or tab. Empty lines and lines that
// begin with # are kept as they are. Throws InputError(path:line, ...): no number, too few columns, no point.
[[nodiscard]] PointTable read_points(const std::string& path, double unit);
// The same text with the points where `displacement` (points x 3, m) takes them; what did not move keeps its
// text.
[[nodiscard]] std::string moved_points(const PointTable& table, const std::vector<Vec3>& displacement,
                                       double unit);
// Puts the points in the place of the body's surface, as vertices that no polygon uses: each goes with the
// nearest element of any part.
void map_points(Body& body, const std::vector<Vec3>& points);

}  // namespace flexel::mapping
