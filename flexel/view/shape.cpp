// Corners of triangles are united across every edge that is no crease; each set is a point.
#include "flexel/view/shape.h"

#include "base/disjoint_sets.h"
#include "flexel/picture/lattice_drawable.h"
#include "flexel/picture/render/drawable.h"

namespace flexel::view {
namespace {

using picture::EdgeKind;
using picture::MeshTopology;

// Unites the corners that triangle t shares with its neighbour across edge i.
void unite_across(const MeshTopology& mesh, std::size_t t, std::size_t i, DisjointSets& corners) {
  const std::uint32_t u = mesh.topology.neighbour[t][i];
  for (const std::size_t own : {i, (i + 1) % 3})
    for (std::size_t other = 0; other < 3; ++other)
      if (mesh.welded[mesh.triangles.corners[t][own]] == mesh.welded[mesh.triangles.corners[u][other]])
        corners.unite(static_cast<std::uint32_t>(3 * t + own), static_cast<std::uint32_t>(3 * u + other));
}

DisjointSets smooth_corners(const MeshTopology& mesh) {
  DisjointSets corners(3 * mesh.triangles.corners.size());
  for (std::size_t t = 0; t < mesh.triangles.corners.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      if (mesh.edges[t][i] != EdgeKind::crease && mesh.topology.neighbour[t][i] != kNoTriangle)
        unite_across(mesh, t, i, corners);
  return corners;
}

void add_lines(const MeshTopology& mesh, Shape& shape) {
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t u = mesh.topology.neighbour[t][i];
      if (mesh.edges[t][i] == EdgeKind::none || (u != kNoTriangle && u < t)) continue;
      auto& lines = mesh.edges[t][i] == EdgeKind::crease ? shape.creases : shape.borders;
      lines.push_back({shape.triangles[t][i], shape.triangles[t][(i + 1) % 3]});
    }
}

}  // namespace

Shape surface_shape(const Surface& surface, bool by_polygon) {
  const MeshTopology mesh = picture::mesh_topology(surface);
  DisjointSets corners = smooth_corners(mesh);
  constexpr std::uint32_t kNoPoint = 0xffffffffu;
  Shape shape;
  // Of each set its points so far, by the vertex: where vertices have values, those at one place may differ.
  const bool by_vertex = !surface.vertex_columns.empty();
  std::vector<std::uint32_t> point(3 * mesh.triangles.corners.size(), kNoPoint), number = corners.numbered();
  const auto point_of = [&](std::size_t t, std::size_t i) {
    const std::size_t corner = 3 * t + i;
    const std::uint32_t root = corners.root(static_cast<std::uint32_t>(corner));
    const std::uint32_t vertex = mesh.triangles.corners[t][i];
    const bool shared =
        !by_polygon && point[root] != kNoPoint && (!by_vertex || shape.source[point[root]] == vertex);
    if (shared) return point[root];
    shape.rest.push_back(surface.vertices[vertex]);
    shape.source.push_back(vertex);
    shape.owner.push_back(mesh.triangles.polygon[t]);
    shape.smooth.push_back(number[corner]);
    return point[root] = static_cast<std::uint32_t>(shape.rest.size() - 1);
  };
  shape.triangles.reserve(mesh.triangles.corners.size());
  shape.face.reserve(mesh.triangles.corners.size());
  for (std::size_t t = 0; t < mesh.triangles.corners.size(); ++t) {
    shape.triangles.push_back({point_of(t, 0), point_of(t, 1), point_of(t, 2)});
    shape.face.push_back(surface.polygon_face[mesh.triangles.polygon[t]]);
  }
  add_lines(mesh, shape);
  return shape;
}

Shape lattice_shape(const Body& body) {
  Shape shape;
  if (body.cell_count() == 0) return shape;
  const picture::CellHull hull = picture::draw_cells(body, body.rest, {});
  for (std::size_t t = 0; t < hull.cell.size(); t += 2) {  // two triangles a side: a b c, a c d
    const auto first = static_cast<std::uint32_t>(shape.rest.size());
    const std::array<std::uint32_t, 4> side = {hull.drawn.triangles[t][0], hull.drawn.triangles[t][1],
                                               hull.drawn.triangles[t][2], hull.drawn.triangles[t + 1][2]};
    for (std::uint32_t i = 0; i < 4; ++i) {
      shape.rest.push_back(body.rest[side[i]]);
      shape.source.push_back(side[i]);
      shape.owner.push_back(hull.cell[t]);
      shape.smooth.push_back(first / 4);
      shape.borders.push_back({first + i, first + (i + 1) % 4});
    }
    shape.triangles.push_back({first, first + 1, first + 2});
    shape.triangles.push_back({first, first + 2, first + 3});
    shape.face.insert(shape.face.end(), 2, hull.drawn.part[t]);
  }
  return shape;
}

}  // namespace flexel::view
