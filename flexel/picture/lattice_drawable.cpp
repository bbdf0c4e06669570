// Shared faces of cells are found by sorting each face by its four elements.
#include "flexel/picture/lattice_drawable.h"

#include <algorithm>
#include <numeric>

#include "base/math/parallel_sort.h"
#include "base/parallel.h"

namespace flexel::picture {
namespace {

// Corners of a cell's six faces, counter-clockwise from outside; corner a = i + 2 j + 4 k.
constexpr std::array<std::array<std::size_t, 4>, 6> kFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

struct Face {
  std::array<std::uint32_t, 4> key;  // its elements, ascending
  std::uint32_t cell;
  std::uint32_t side;
  bool operator<(const Face& other) const {
    return key != other.key ? key < other.key : cell != other.cell ? cell < other.cell : side < other.side;
  }
};

// Cells that are drawn: broken ones would span the crack that they left. A body of nothing else shows them.
std::vector<std::uint32_t> drawn_cells(const Body& body) {
  std::vector<std::uint32_t> drawn;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (body.broken[c] == 0) drawn.push_back(c);
  if (drawn.empty()) {
    drawn.resize(body.cell_count());
    std::iota(drawn.begin(), drawn.end(), 0u);
  }
  return drawn;
}

std::vector<Face> open_faces(const Body& body) {
  const std::vector<std::uint32_t> cells = drawn_cells(body);
  std::vector<Face> faces(6 * cells.size());
  parallel_for_each(faces.size(), [&](std::size_t f) {
    Face& face = faces[f];
    face.cell = cells[f / 6];
    face.side = static_cast<std::uint32_t>(f % 6);
    for (std::size_t i = 0; i < 4; ++i) face.key[i] = body.cell_elements[face.cell][kFaces[face.side][i]];
    std::sort(face.key.begin(), face.key.end());
  });
  parallel_sort(faces.begin(), faces.end(), std::less<>());
  std::vector<Face> open;
  for (std::size_t f = 0; f < faces.size();) {
    std::size_t stop = f + 1;
    while (stop < faces.size() && faces[stop].key == faces[f].key) ++stop;
    if (stop == f + 1) open.push_back(faces[f]);
    f = stop;
  }
  std::sort(open.begin(), open.end(), [](const Face& a, const Face& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.side < b.side;
  });
  return open;
}

}  // namespace

CellHull draw_cells(const Body& body, const std::vector<Vec3>& positions, const DrawingFrame& frame) {
  const std::vector<Face> open = open_faces(body);
  const std::vector<std::uint32_t> parts = cell_parts(body);
  CellHull hull;
  Drawable& drawn = hull.drawn;
  drawn.vertices.resize(positions.size());
  parallel_for_each(positions.size(), [&](std::size_t e) { drawn.vertices[e] = frame.drawn(positions[e]); });
  for (const Face& face : open) {
    std::array<std::uint32_t, 4> q{};
    for (std::size_t i = 0; i < 4; ++i) q[i] = body.cell_elements[face.cell][kFaces[face.side][i]];
    drawn.triangles.push_back({q[0], q[1], q[2]});
    drawn.triangles.push_back({q[0], q[2], q[3]});
    drawn.edges.push_back({EdgeKind::border, EdgeKind::border, EdgeKind::none});
    drawn.edges.push_back({EdgeKind::none, EdgeKind::border, EdgeKind::border});
    for (int half = 0; half < 2; ++half) {
      hull.cell.push_back(face.cell);
      drawn.part.push_back(parts[face.cell]);
      drawn.face.push_back(6 * parts[face.cell] + face.side);
    }
  }
  std::vector<std::uint32_t> self(positions.size());
  std::iota(self.begin(), self.end(), 0u);
  drawn.neighbour = topology(drawn.triangles, self).neighbour;
  drawn.normals = smooth_normals(drawn.vertices, drawn.triangles, self);
  return hull;
}

Drawable draw_elements(const Body& body, const std::vector<Vec3>& positions, const DrawingFrame& frame) {
  Drawable drawn;
  drawn.part = element_parts(body);
  drawn.spheres.resize(positions.size());
  parallel_for_each(positions.size(), [&](std::size_t e) {
    const double radius = 0.45 * body.parts[drawn.part[e]].lattice.spacing.minCoeff() / frame.radius;
    drawn.spheres[e].head<3>() = frame.drawn(positions[e]);
    drawn.spheres[e].w() = static_cast<float>(radius);
  });
  return drawn;
}

}  // namespace flexel::picture
