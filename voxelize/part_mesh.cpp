// Parts as welded triangle meshes. Edges are found by sorting half-edges into buckets by their lower vertex
// (linear time) and then each small bucket by its upper vertex; shells by union-find over edges.
#include "voxelize/part_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "formats/parallel.h"
#include "formats/topology.h"
#include "voxelize/union_find.h"

namespace flexel {
namespace {

struct HalfEdge {
  std::uint32_t upper;  // the higher vertex
  std::uint32_t slot;   // 3 * triangle + side
};

// Half-edges in buckets by lower vertex, each bucket sorted by (upper, slot).
struct HalfEdges {
  std::vector<std::uint32_t> begin;  // (vertices + 1)
  std::vector<HalfEdge> entries;     // (3 triangles)
};

HalfEdges half_edges(const PartMesh& mesh) {
  HalfEdges result;
  result.begin.assign(mesh.world.size() + 2, 0);
  for (const Corners& c : mesh.corners)
    for (int e = 0; e < 3; ++e) ++result.begin[std::min(c[e], c[(e + 1) % 3]) + 2];
  std::partial_sum(result.begin.begin(), result.begin.end(), result.begin.begin());
  result.entries.resize(3 * mesh.corners.size());
  for (std::size_t t = 0; t < mesh.corners.size(); ++t)
    for (int e = 0; e < 3; ++e) {
      const auto [lower, upper] = std::minmax(mesh.corners[t][e], mesh.corners[t][(e + 1) % 3]);
      result.entries[result.begin[lower + 1]++] = {upper, static_cast<std::uint32_t>(3 * t + e)};
    }
  result.begin.pop_back();
  parallel_for_each(mesh.world.size(), [&](std::size_t v) {
    std::sort(result.entries.begin() + result.begin[v], result.entries.begin() + result.begin[v + 1],
              [](const HalfEdge& a, const HalfEdge& b) {
                return a.upper != b.upper ? a.upper < b.upper : a.slot < b.slot;
              });
  });
  return result;
}

void number_shells(PartMesh& mesh) {
  UnionFind sets(mesh.corners.size());
  std::vector<std::uint32_t> first(mesh.edge_count, kNoTriangle);
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    for (const std::uint32_t edge : mesh.edges[t]) {
      if (first[edge] == kNoTriangle)
        first[edge] = t;
      else
        sets.join(first[edge], t);
    }
  mesh.shell.assign(mesh.corners.size(), kNoTriangle);
  mesh.shell_count = 0;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    const std::uint32_t root = sets.root(t);  // the lowest triangle of the set
    mesh.shell[t] = root == t ? mesh.shell_count++ : mesh.shell[root];
  }
}

// Compacts the vertices that triangles [of one part] use, in order of index, and drops triangles with a
// repeated corner.
PartMesh build_mesh(const Surface& surface, const Triangles& triangles, std::span<const std::uint32_t> chosen,
                    const std::vector<std::uint32_t>& welded) {
  PartMesh mesh;
  std::vector<std::uint32_t> number(surface.vertices.size(), kNoTriangle);
  for (const std::uint32_t t : chosen) {
    Corners c;
    for (int a = 0; a < 3; ++a) c[a] = welded[triangles.corners[t][a]];
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    for (std::uint32_t& v : c) {
      if (number[v] == kNoTriangle) {
        number[v] = static_cast<std::uint32_t>(mesh.world.size());
        mesh.world.push_back(surface.vertices[v]);
      }
      v = number[v];
    }
    mesh.corners.push_back(c);
    mesh.polygon.push_back(triangles.polygon[t]);
  }
  number_edges(mesh);
  return mesh;
}

// Representatives of vertices within `tolerance` of each other: each vertex takes the first earlier one that
// is near, by a sweep along x.
std::vector<std::uint32_t> weld_near(const std::vector<Vec3>& vertices,
                                     const std::vector<std::uint32_t>& used, double tolerance) {
  std::vector<std::uint32_t> order(used);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return vertices[a].x() != vertices[b].x() ? vertices[a].x() < vertices[b].x() : a < b;
  });
  std::vector<std::uint32_t> result(vertices.size());
  std::iota(result.begin(), result.end(), 0u);
  for (std::size_t n = 0; n < order.size(); ++n)
    for (std::size_t m = n; m-- > 0 && vertices[order[n]].x() - vertices[order[m]].x() <= tolerance;)
      if ((vertices[order[n]] - vertices[order[m]]).squaredNorm() <= tolerance * tolerance) {
        result[order[n]] = result[order[m]];
        break;
      }
  return result;
}

std::vector<std::uint32_t> used_vertices(const Triangles& triangles, std::span<const std::uint32_t> chosen,
                                         const std::vector<std::uint32_t>& welded) {
  std::vector<std::uint32_t> used;
  for (const std::uint32_t t : chosen)
    for (const std::uint32_t v : triangles.corners[t]) used.push_back(welded[v]);
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return used;
}

// Float noise in a file's coordinates opens cracks far below any lattice spacing: close them where that makes
// the part whole.
PartMesh close_cracks(const Surface& surface, const Triangles& triangles,
                      std::span<const std::uint32_t> chosen, std::vector<std::uint32_t> welded,
                      PartMesh open) {
  constexpr double kRelativeTolerance = 1e-7;  // of the diagonal
  const double tolerance = kRelativeTolerance * bounding_box(open.world).diagonal();
  const auto near = weld_near(surface.vertices, used_vertices(triangles, chosen, welded), tolerance);
  for (std::uint32_t& v : welded) v = near[v];
  PartMesh mesh = build_mesh(surface, triangles, chosen, welded);
  if (mesh.open_edges > 0 || mesh.corners.empty()) return open;
  mesh.cracks_closed = true;
  return mesh;
}

std::vector<PartMesh> make_meshes(const Surface& surface, bool closing) {
  const Triangles triangles = triangulate(surface);
  const std::vector<std::uint32_t> welded = weld(surface.vertices);
  std::vector<std::vector<std::uint32_t>> of_part(surface.parts.size());
  for (std::uint32_t t = 0; t < triangles.corners.size(); ++t)
    of_part[surface.polygon_part(triangles.polygon[t])].push_back(t);
  std::vector<PartMesh> meshes;
  for (const auto& chosen : of_part) {
    PartMesh mesh = build_mesh(surface, triangles, chosen, welded);
    if (closing && mesh.open_edges > 0)
      mesh = close_cracks(surface, triangles, chosen, welded, std::move(mesh));
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

}  // namespace

void number_edges(PartMesh& mesh) {
  const HalfEdges half = half_edges(mesh);
  mesh.edges.resize(mesh.corners.size());
  mesh.edge_count = 0;
  mesh.open_edges = mesh.unbalanced_edges = 0;
  for (std::size_t v = 0; v < mesh.world.size(); ++v)
    for (std::uint32_t n = half.begin[v]; n < half.begin[v + 1];) {
      const std::uint32_t upper = half.entries[n].upper;
      int balance = 0, count = 0;
      for (; n < half.begin[v + 1] && half.entries[n].upper == upper; ++n, ++count) {
        const std::uint32_t t = half.entries[n].slot / 3, e = half.entries[n].slot % 3;
        mesh.edges[t][e] = mesh.edge_count;
        balance += mesh.corners[t][e] == v ? 1 : -1;
      }
      ++mesh.edge_count;
      mesh.open_edges += count % 2;
      mesh.unbalanced_edges += balance != 0;
    }
  number_shells(mesh);
}

std::vector<PartMesh> part_meshes(const Surface& surface) {
  return make_meshes(surface, true);
}

std::vector<PartMesh> exact_part_meshes(const Surface& surface) {
  return make_meshes(surface, false);
}

void place_on_lattice(PartMesh& mesh, const Lattice& lattice, double tolerance) {
  mesh.vertices.resize(mesh.world.size());
  parallel_for_each(mesh.world.size(), [&](std::size_t v) {
    Vec3 u = lattice.to_lattice(mesh.world[v]);
    for (double& coordinate : u) {
      const double whole = std::round(coordinate);
      if (std::abs(coordinate - whole) <= tolerance) coordinate = whole;
    }
    mesh.vertices[v] = u;
  });
}

double enclosed_volume(const PartMesh& mesh) {
  return mesh.corners.empty() ? 0 : signed_volume(mesh.world, mesh.corners);
}

double surface_area(const PartMesh& mesh) {
  return parallel_sum<double>(mesh.corners.size(), [&](std::size_t t) {
    const Vec3& a = mesh.world[mesh.corners[t][0]];
    return (mesh.world[mesh.corners[t][1]] - a).cross(mesh.world[mesh.corners[t][2]] - a).norm() / 2;
  });
}

}  // namespace flexel
