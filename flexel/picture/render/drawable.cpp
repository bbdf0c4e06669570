// The edges are those of the shape at rest: a fold that the load made is shaded, not outlined.
#include "flexel/picture/render/drawable.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/math/area_vector.h"
#include "base/parallel.h"

namespace flexel::picture {
namespace {

constexpr double kCrease = 30 * std::numbers::pi / 180;
constexpr float kSmooth = 0.819f;  // cosine of 35 degrees

// Which way triangles t and u, that share edge `i` of t, run it: the same way when one of them is flipped.
bool flipped(const MeshTopology& mesh, std::size_t t, std::size_t i, std::uint32_t u) {
  const std::uint32_t from = mesh.welded[mesh.triangles.corners[t][i]];
  const std::uint32_t to = mesh.welded[mesh.triangles.corners[t][(i + 1) % 3]];
  for (std::size_t j = 0; j < 3; ++j)
    if (mesh.welded[mesh.triangles.corners[u][j]] == from &&
        mesh.welded[mesh.triangles.corners[u][(j + 1) % 3]] == to)
      return true;
  return false;
}

// Needles have no direction of their own and make no crease.
bool is_crease(const Vec3& a, const Vec3& b, bool turned, double noise) {
  const double lengths = a.norm() * b.norm();
  if (a.norm() <= noise || b.norm() <= noise) return false;
  return (turned ? -a.dot(b) : a.dot(b)) < std::cos(kCrease) * lengths;
}

// On coarse round shapes single edges pass the angle of a crease. Connected creases stay where one
// of them is sharp, or an end of the surface, or all of them together are long.
void drop_stray_creases(const Surface& surface, const MeshTopology& mesh, const std::vector<Vec3>& area,
                        std::vector<std::array<EdgeKind, 3>>& edges) {
  constexpr double kSharp = 0.707;  // cosine of 45 degrees
  const double long_enough = 0.25 * bounding_box(surface.vertices).diagonal();
  const auto for_each_crease = [&](const auto& use) {
    for (std::size_t t = 0; t < edges.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i)
        if (edges[t][i] == EdgeKind::crease)
          use(t, i, mesh.welded[mesh.triangles.corners[t][i]],
              mesh.welded[mesh.triangles.corners[t][(i + 1) % 3]]);
  };
  DisjointSets sets(surface.vertices.size());
  for_each_crease(
      [&](std::size_t, std::size_t, std::uint32_t from, std::uint32_t to) { sets.unite(from, to); });
  std::vector<double> length(surface.vertices.size(), 0);
  for_each_crease([&](std::size_t t, std::size_t i, std::uint32_t from, std::uint32_t to) {
    const std::uint32_t u = mesh.topology.neighbour[t][i];
    const bool sharp =
        u == kNoTriangle || std::abs(area[t].dot(area[u])) < kSharp * area[t].norm() * area[u].norm();
    // Both triangles of an edge come by: half of it each.
    length[sets.root(from)] +=
        sharp ? long_enough : 0.5 * (surface.vertices[to] - surface.vertices[from]).norm();
  });
  for_each_crease([&](std::size_t t, std::size_t i, std::uint32_t from, std::uint32_t) {
    if (length[sets.root(from)] < long_enough) edges[t][i] = EdgeKind::none;
  });
}

std::vector<std::array<EdgeKind, 3>> classify_edges(const Surface& surface, const MeshTopology& mesh) {
  const std::size_t n = mesh.triangles.corners.size();
  const double diagonal = bounding_box(surface.vertices).diagonal();
  std::vector<Vec3> area(n);
  parallel_for_each(
      n, [&](std::size_t t) { area[t] = area_vector(surface.vertices, mesh.triangles.corners[t]); });
  std::vector<std::array<EdgeKind, 3>> edges(n);
  parallel_for_each(n, [&](std::size_t t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t u = mesh.topology.neighbour[t][i];
      edges[t][i] = EdgeKind::crease;
      if (u == kNoTriangle) continue;
      const bool turned = mesh.topology.misoriented_edges > 0 && flipped(mesh, t, i, u);
      if (is_crease(area[t], area[u], turned, 1e-12 * diagonal * diagonal)) continue;
      const bool other_face =
          surface.polygon_face[mesh.triangles.polygon[t]] != surface.polygon_face[mesh.triangles.polygon[u]];
      edges[t][i] = other_face ? EdgeKind::border : EdgeKind::none;
    }
  });
  drop_stray_creases(surface, mesh, area, edges);
  return edges;
}

// The corners (3 t + i) at each place, in compressed rows.
struct CornersAt {
  std::vector<std::uint32_t> starts, corners;
};

CornersAt corners_at(const std::vector<std::array<std::uint32_t, 3>>& triangles,
                     const std::vector<std::uint32_t>& welded) {
  CornersAt at{std::vector<std::uint32_t>(welded.size() + 1, 0),
               std::vector<std::uint32_t>(3 * triangles.size())};
  for (const auto& triangle : triangles)
    for (const std::uint32_t v : triangle) ++at.starts[welded[v] + 1];
  std::partial_sum(at.starts.begin(), at.starts.end(), at.starts.begin());
  std::vector<std::uint32_t> next(at.starts.begin(), at.starts.end() - 1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint32_t i = 0; i < 3; ++i) at.corners[next[welded[triangles[t][i]]]++] = 3 * t + i;
  return at;
}

struct Facet {
  Vec3f normal = Vec3f::Zero();
  std::array<float, 3> weight{};  // by corner: area times angle
};

Facet facet_of(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f cross = (b - a).cross(c - a);
  const float area = cross.norm();
  if (!(area > 0)) return {};
  const auto angle = [&](const Vec3f& at, const Vec3f& p, const Vec3f& q) {
    return std::atan2(area, (p - at).dot(q - at));
  };
  return {cross / area, {area * angle(a, b, c), area * angle(b, c, a), area * angle(c, a, b)}};
}

}  // namespace

std::vector<std::array<Vec3f, 3>> smooth_normals(const std::vector<Vec3f>& vertices,
                                                 const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                                 const std::vector<std::uint32_t>& welded) {
  const CornersAt at = corners_at(triangles, welded);
  std::vector<Facet> facets(triangles.size());
  parallel_for_each(triangles.size(), [&](std::size_t t) {
    facets[t] = facet_of(vertices[triangles[t][0]], vertices[triangles[t][1]], vertices[triangles[t][2]]);
  });
  std::vector<std::array<Vec3f, 3>> normals(triangles.size());
  parallel_for_each(triangles.size(), [&](std::size_t t) {
    const Vec3f own = facets[t].normal;
    for (std::size_t i = 0; i < 3; ++i) {
      Vec3f sum = Vec3f::Zero();
      const std::uint32_t place = welded[triangles[t][i]];
      for (std::uint32_t k = at.starts[place]; k < at.starts[place + 1]; ++k) {
        const Facet& other = facets[at.corners[k] / 3];
        const float cosine = own.dot(other.normal);
        if (std::abs(cosine) > kSmooth)
          sum += other.weight[at.corners[k] % 3] * std::copysign(1.0f, cosine) * other.normal;
      }
      const float length = sum.norm();
      normals[t][i] = length > 0 ? Vec3f(sum / length) : own;
    }
  });
  return normals;
}

MeshTopology mesh_topology(const Surface& surface) {
  MeshTopology mesh;
  mesh.triangles = triangulate(surface);
  mesh.welded = weld(surface.vertices);
  mesh.topology = topology(mesh.triangles.corners, mesh.welded);
  mesh.edges = classify_edges(surface, mesh);
  return mesh;
}

Drawable draw_surface(const Surface& surface, const MeshTopology& mesh, const std::vector<Vec3>& positions,
                      const DrawingFrame& frame) {
  Drawable drawn;
  drawn.vertices.resize(positions.size());
  parallel_for_each(positions.size(), [&](std::size_t v) { drawn.vertices[v] = frame.drawn(positions[v]); });
  drawn.triangles = mesh.triangles.corners;
  drawn.edges = mesh.edges;
  drawn.neighbour = mesh.topology.neighbour;
  drawn.normals = smooth_normals(drawn.vertices, drawn.triangles, mesh.welded);
  const std::size_t n = drawn.triangles.size();
  drawn.face.resize(n);
  drawn.part.resize(n);
  parallel_for_each(n, [&](std::size_t t) {
    drawn.face[t] = surface.polygon_face[mesh.triangles.polygon[t]];
    drawn.part[t] = surface.faces[drawn.face[t]].part;
  });
  return drawn;
}

}  // namespace flexel::picture
