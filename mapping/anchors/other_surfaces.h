// Mapping surfaces and points that did not come with the body (--onto, --points).
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "mapping/anchors/vertex_anchor.h"

namespace flexel::mapping {

// Replaces the body's surface by `surface`. Each of its parts goes with the body's part of the same name or,
// where there is none, with the one whose elements are nearest to its vertices in the mean. `surface` itself
// stays, for writing. Throws InputError: a part of the body without elements.
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
// Puts the points in the place of the body's surface, as vertices that no polygon uses, and finds their anchors: each
// goes with the part and the wall whose matter it is of, as probes do (formats/lattice/locate.h); further than a spacing
// from all voxels with the part whose cells are nearest. Throws InputError: a part without elements.
[[nodiscard]] VertexAnchors map_points(Body& body, const std::vector<Vec3>& points);

}  // namespace flexel::mapping
