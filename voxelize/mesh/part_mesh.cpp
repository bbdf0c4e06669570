// Parts as welded triangle meshes. Edges are found by sorting half-edges into buckets by their lower vertex
// (linear time) and then each small bucket by its upper vertex; shells by union-find over edges.
#include "voxelize/mesh/part_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/bucket.h"
#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "formats/part/topology.h"

namespace flexel::voxelize {
namespace {

struct HalfEdge {
  std::uint32_t upper;  // the higher vertex
  std::uint32_t slot;   // 3 * triangle + side
};

// Half-edges in buckets by lower vertex, each bucket sorted by (upper, slot).
Buckets<HalfEdge> half_edges(const PartMesh& mesh) {
  Buckets<HalfEdge> result = sort_into_buckets<HalfEdge>(mesh.world.size(), [&](const auto& use) {
    for (std::size_t t = 0; t < mesh.corners.size(); ++t)
      for (int e = 0; e < 3; ++e) {
        const auto [lower, upper] = std::minmax(mesh.corners[t][e], mesh.corners[t][(e + 1) % 3]);
        use(lower, HalfEdge{upper, static_cast<std::uint32_t>(3 * t + e)});
      }
  });
  parallel_for_each(mesh.world.size(), [&](std::size_t v) {
    std::sort(result.values.begin() + result.begin[v], result.values.begin() + result.begin[v + 1],
              [](const HalfEdge& a, const HalfEdge& b) {
                return a.upper != b.upper ? a.upper < b.upper : a.slot < b.slot;
              });
  });
  return result;
}

// What is counted over the edges of a range of lower vertices.
struct EdgeTally {
  std::uint32_t edges = 0;
  std::size_t open = 0, crowded = 0, unbalanced = 0;
};

// Numbers the edges from lower vertex `v` on; counts them too.
void number_edges_of(std::size_t v, const Buckets<HalfEdge>& half, EdgeTally& tally, PartMesh& mesh) {
  for (std::uint32_t n = half.begin[v]; n < half.begin[v + 1];) {
    const std::uint32_t upper = half.values[n].upper;
    int balance = 0, count = 0;
    for (; n < half.begin[v + 1] && half.values[n].upper == upper; ++n, ++count) {
      const std::uint32_t t = half.values[n].slot / 3, e = half.values[n].slot % 3;
      mesh.edges[t][e] = tally.edges;
      balance += mesh.corners[t][e] == v ? 1 : -1;
    }
    ++tally.edges;
    tally.open += static_cast<std::size_t>(count % 2);
    tally.crowded += count > 2;
    tally.unbalanced += balance != 0;
  }
}

// How many edges lie in the buckets [begin, end).
std::uint32_t count_edges(const Buckets<HalfEdge>& half, std::size_t begin, std::size_t end) {
  std::uint32_t edges = 0;
  for (std::size_t v = begin; v < end; ++v)
    for (std::uint32_t n = half.begin[v]; n < half.begin[v + 1]; ++n)
      edges += n == half.begin[v] || half.values[n].upper != half.values[n - 1].upper;
  return edges;
}

void number_shells(PartMesh& mesh) {
  DisjointSets sets(mesh.corners.size());
  std::vector<std::uint32_t> first(mesh.edge_count, kNoTriangle);
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    for (const std::uint32_t edge : mesh.edges[t]) {
      if (first[edge] == kNoTriangle)
        first[edge] = t;
      else
        sets.unite(first[edge], t);
    }
  mesh.shell.assign(mesh.corners.size(), kNoTriangle);
  mesh.shell_count = 0;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    const std::uint32_t root = sets.root(t);  // the lowest triangle of the set
    mesh.shell[t] = root == t ? mesh.shell_count++ : mesh.shell[root];
  }
}

// Compacts the vertices that triangles [of one part] use, in order of index, and drops triangles with a
// repeated corner. `number` (vertices of the surface) is kNoTriangle throughout, before and after: a surface of
// many parts is not gone through once for each.
PartMesh build_mesh(const Surface& surface, const Triangles& triangles, std::span<const std::uint32_t> chosen,
                    const std::vector<std::uint32_t>& welded, std::vector<std::uint32_t>& number) {
  PartMesh mesh;
  mesh.corners.reserve(chosen.size());
  mesh.polygon.reserve(chosen.size());
  for (const std::uint32_t t : chosen) {
    Corners c;
    for (int a = 0; a < 3; ++a) c[a] = welded[triangles.corners[t][a]];
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) {
      ++mesh.degenerate_triangles;
      continue;
    }
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
  for (const std::uint32_t t : chosen)
    for (const std::uint32_t v : triangles.corners[t]) number[welded[v]] = kNoTriangle;
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
                      std::span<const std::uint32_t> chosen, std::vector<std::uint32_t> welded, PartMesh open,
                      std::vector<std::uint32_t>& number) {
  constexpr double kRelativeTolerance = 1e-7;  // of the diagonal
  const double tolerance = kRelativeTolerance * bounding_box(open.world).diagonal();
  const auto near = weld_near(surface.vertices, used_vertices(triangles, chosen, welded), tolerance);
  for (std::uint32_t& v : welded) v = near[v];
  PartMesh mesh = build_mesh(surface, triangles, chosen, welded, number);
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
  std::vector<std::uint32_t> number(surface.vertices.size(), kNoTriangle);
  for (const auto& chosen : of_part) {
    check_stop();
    PartMesh mesh = build_mesh(surface, triangles, chosen, welded, number);
    if (closing && mesh.open_edges > 0)
      mesh = close_cracks(surface, triangles, chosen, welded, std::move(mesh), number);
    meshes.push_back(std::move(mesh));
  }
  return meshes;
}

}  // namespace

void number_edges(PartMesh& mesh) {
  constexpr std::size_t kGrain = 1 << 14;
  const Buckets<HalfEdge> half = half_edges(mesh);
  resize_touched(mesh.edges, mesh.corners.size());
  const std::size_t vertices = mesh.world.size();
  std::vector<EdgeTally> tallies((vertices + kGrain - 1) / kGrain);
  parallel_chunks(vertices, kGrain, [&](std::size_t begin, std::size_t end) {
    tallies[begin / kGrain].edges = count_edges(half, begin, end);
  });
  mesh.edge_count = 0;
  for (EdgeTally& tally : tallies) mesh.edge_count += std::exchange(tally.edges, mesh.edge_count);
  parallel_chunks(vertices, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) number_edges_of(v, half, tallies[begin / kGrain], mesh);
  });
  mesh.open_edges = mesh.crowded_edges = mesh.unbalanced_edges = 0;
  for (const EdgeTally& tally : tallies) {
    mesh.open_edges += tally.open;
    mesh.crowded_edges += tally.crowded;
    mesh.unbalanced_edges += tally.unbalanced;
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
  return parallel_sum<double>(
      mesh.corners.size(), [&](std::size_t t) { return triangle_area(mesh, static_cast<std::uint32_t>(t)); });
}

double triangle_area(const PartMesh& mesh, std::uint32_t triangle) {
  const Corners& c = mesh.corners[triangle];
  return (mesh.world[c[1]] - mesh.world[c[0]]).cross(mesh.world[c[2]] - mesh.world[c[0]]).norm() / 2;
}

Vec3 unit_normal(const PartMesh& mesh, std::uint32_t triangle) {
  const Corners& c = mesh.corners[triangle];
  return (mesh.world[c[1]] - mesh.world[c[0]]).cross(mesh.world[c[2]] - mesh.world[c[0]]).normalized();
}

}  // namespace flexel::voxelize
