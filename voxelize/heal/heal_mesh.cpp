// Vertices are welded through a spatial hash with cells as wide as the tolerance. Fins: cut at all edges
// without exactly two triangles, the surface falls into patches. Removing a patch lowers the number of
// triangles at each edge of its rim by one, so a patch is a fin if all these numbers are odd.
#include "voxelize/heal/heal_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "formats/part/topology.h"

namespace flexel::voxelize {
namespace {

bool repeats(const Corners& c) {
  return c[0] == c[1] || c[1] == c[2] || c[2] == c[0];
}

// Vertices (by index) that lie on edges with an odd number of triangles.
std::vector<std::uint32_t> vertices_of_open_edges(const PartMesh& mesh) {
  const std::vector<std::uint32_t> degree = edge_degrees(mesh);
  std::vector<std::uint8_t> open(mesh.world.size(), 0);
  for (std::size_t t = 0; t < mesh.corners.size(); ++t)
    for (int e = 0; e < 3; ++e)
      if (degree[mesh.edges[t][e]] % 2 != 0)
        open[mesh.corners[t][e]] = open[mesh.corners[t][(e + 1) % 3]] = 1;
  std::vector<std::uint32_t> result;
  for (std::uint32_t v = 0; v < open.size(); ++v)
    if (open[v]) result.push_back(v);
  return result;
}

using GridCell = std::array<std::int64_t, 3>;
struct CellHash {
  std::size_t operator()(const GridCell& c) const {
    std::uint64_t h = 0x9e3779b97f4a7c15u;
    for (const std::int64_t x : c)
      h = (h ^ static_cast<std::uint64_t>(x)) * 0xff51afd7ed558ccdu, h ^= h >> 32;
    return h;
  }
};

// For every vertex itself or, among `chosen`, the first earlier one within `tolerance`.
std::vector<std::uint32_t> join_near(const std::vector<Vec3>& points,
                                     const std::vector<std::uint32_t>& chosen, double tolerance) {
  std::vector<std::uint32_t> result(points.size());
  std::iota(result.begin(), result.end(), 0u);
  std::unordered_map<GridCell, std::vector<std::uint32_t>, CellHash> cells;
  const Vec3 base = points.empty() ? Vec3(Vec3::Zero()) : points[0];
  for (const std::uint32_t v : chosen) {
    GridCell cell;
    for (int a = 0; a < 3; ++a)
      cell[a] = static_cast<std::int64_t>(std::floor((points[v][a] - base[a]) / tolerance));
    for (int n = 0; n < 27 && result[v] == v; ++n) {
      const auto found = cells.find({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
      if (found == cells.end()) continue;
      for (const std::uint32_t other : found->second)
        if ((points[other] - points[v]).squaredNorm() <= tolerance * tolerance) {
          result[v] = other;
          break;
        }
    }
    if (result[v] == v) cells[cell].push_back(v);
  }
  return result;
}

// Patches between edges that have not exactly two triangles: the root of each triangle.
std::vector<std::uint32_t> patches(const PartMesh& mesh, const std::vector<std::uint32_t>& degree) {
  DisjointSets sets(mesh.corners.size());
  std::vector<std::uint32_t> first(mesh.edge_count, kNoTriangle), root(mesh.corners.size());
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    for (const std::uint32_t edge : mesh.edges[t]) {
      if (degree[edge] != 2) continue;
      if (first[edge] == kNoTriangle)
        first[edge] = t;
      else
        sets.unite(first[edge], t);
    }
  for (std::uint32_t t = 0; t < root.size(); ++t) root[t] = sets.root(t);
  return root;
}

// What a patch's rim is like, by its root.
struct Rim {
  std::size_t open = 0;           // edges with one triangle
  std::size_t odd = 0, even = 0;  // edges with three or more
};

// Volume [m^3] of the cones from the centroid of each group of triangles to them, by group. Triangles of
// kNoTriangle belong to none.
std::map<std::uint32_t, double> cone_volumes(const PartMesh& mesh, const std::vector<std::uint32_t>& group) {
  std::map<std::uint32_t, std::pair<Vec3, double>> moments;
  const auto middle = [&](std::uint32_t t) {
    const Corners& c = mesh.corners[t];
    return Vec3((mesh.world[c[0]] + mesh.world[c[1]] + mesh.world[c[2]]) / 3);
  };
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    if (group[t] == kNoTriangle) continue;
    auto& [sum, area] = moments.try_emplace(group[t], Vec3::Zero(), 0.).first->second;
    sum += triangle_area(mesh, t) * middle(t);
    area += triangle_area(mesh, t);
  }
  std::map<std::uint32_t, double> volume;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    if (group[t] == kNoTriangle) continue;
    const auto& [sum, area] = moments.at(group[t]);
    if (!(area > 0)) continue;
    const Corners& c = mesh.corners[t];
    const Vec3 apex = sum / area;
    volume[group[t]] +=
        std::abs((mesh.world[c[0]] - apex).dot((mesh.world[c[1]] - apex).cross(mesh.world[c[2]] - apex))) / 6;
  }
  return volume;
}

std::unordered_map<std::uint32_t, Rim> rims_of(const PartMesh& mesh, const std::vector<std::uint32_t>& degree,
                                               const std::vector<std::uint32_t>& patch) {
  std::unordered_map<std::uint32_t, Rim> rims;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    Rim& rim = rims[patch[t]];
    for (const std::uint32_t edge : mesh.edges[t]) {
      rim.open += degree[edge] == 1;
      if (degree[edge] > 2) ++(degree[edge] % 2 != 0 ? rim.odd : rim.even);
    }
  }
  return rims;
}

// Two fins at one edge are left to the next round: without both its number of triangles would be odd again.
std::size_t drop_fins_once(PartMesh& mesh, double& budget) {
  const std::vector<std::uint32_t> degree = edge_degrees(mesh), patch = patches(mesh, degree);
  const auto rims = rims_of(mesh, degree, patch);
  std::vector<std::uint32_t> taken(mesh.edge_count, kNoTriangle);  // the fin that goes at each edge
  std::map<std::uint32_t, bool> goes;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    const Rim& rim = rims.at(patch[t]);
    if (rim.open == 0 || rim.odd == 0 || rim.even > 0) continue;
    bool& fin = goes.try_emplace(patch[t], true).first->second;
    for (const std::uint32_t edge : mesh.edges[t]) {
      if (degree[edge] <= 2) continue;
      if (taken[edge] == kNoTriangle) taken[edge] = patch[t];
      fin = fin && taken[edge] == patch[t];
    }
  }
  std::vector<std::uint32_t> group(patch);
  for (std::uint32_t& root : group)
    if (!goes.count(root)) root = kNoTriangle;
  for (const auto& [root, volume] : cone_volumes(mesh, group)) {
    goes[root] = goes[root] && volume <= budget;
    if (goes[root]) budget -= volume;
  }
  std::vector<std::uint8_t> keep(mesh.corners.size(), 1);
  for (std::uint32_t t = 0; t < keep.size(); ++t)
    if (const auto found = goes.find(patch[t]); found != goes.end()) keep[t] = !found->second;
  const auto dropped = static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 0));
  if (dropped > 0) keep_triangles(mesh, keep);
  return dropped;
}

}  // namespace

Corners sorted_corners(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return corners;
}

std::vector<std::uint32_t> edge_degrees(const PartMesh& mesh) {
  std::vector<std::uint32_t> degree(mesh.edge_count, 0);
  for (const Corners& edges : mesh.edges)
    for (const std::uint32_t edge : edges) ++degree[edge];
  return degree;
}

void keep_triangles(PartMesh& mesh, const std::vector<std::uint8_t>& keep) {
  std::vector<std::uint32_t> number(mesh.world.size(), kNoTriangle);
  std::vector<Vec3> world;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.corners.size(); ++t) {
    if (!keep[t]) continue;
    Corners c = mesh.corners[t];
    for (std::uint32_t& v : c) {
      if (number[v] == kNoTriangle) {
        number[v] = static_cast<std::uint32_t>(world.size());
        world.push_back(mesh.world[v]);
      }
      v = number[v];
    }
    mesh.corners[kept] = c;
    mesh.polygon[kept++] = mesh.polygon[t];
  }
  mesh.corners.resize(kept);
  mesh.polygon.resize(kept);
  mesh.world = std::move(world);
  number_edges(mesh);
}

std::size_t drop_duplicates(PartMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.corners.size());
  std::iota(order.begin(), order.end(), 0u);
  std::vector<Corners> key(mesh.corners.size());
  for (std::size_t t = 0; t < key.size(); ++t) key[t] = sorted_corners(mesh.corners[t]);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key[a] != key[b] ? key[a] < key[b] : a < b; });
  std::vector<std::uint32_t> degree;
  std::vector<std::uint8_t> keep(mesh.corners.size(), 1);
  std::size_t dropped = 0;
  for (std::size_t n = 0, end; n < order.size(); n = end) {
    for (end = n + 1; end < order.size() && key[order[end]] == key[order[n]];) ++end;
    const std::size_t copies = end - n;
    if (copies == 1) continue;
    if (degree.empty()) degree = edge_degrees(mesh);
    int needed = 0;  // of the three edges
    for (const std::uint32_t edge : mesh.edges[order[n]]) needed += (degree[edge] - copies) % 2 != 0;
    for (std::size_t m = needed >= 2 ? n + 1 : n; m < end; ++m, ++dropped) keep[order[m]] = 0;
  }
  if (dropped > 0) keep_triangles(mesh, keep);
  return dropped;
}

std::size_t weld_open_edges(PartMesh& mesh, double tolerance) {
  if (mesh.open_edges == 0 || !(tolerance > 0)) return 0;
  const std::vector<std::uint32_t> near = join_near(mesh.world, vertices_of_open_edges(mesh), tolerance);
  PartMesh joined = mesh;
  std::vector<std::uint8_t> keep(mesh.corners.size(), 1);
  for (std::size_t t = 0; t < keep.size(); ++t) {
    for (std::uint32_t& v : joined.corners[t]) v = near[v];
    keep[t] = !repeats(joined.corners[t]);
  }
  keep_triangles(joined, keep);
  if (joined.open_edges >= mesh.open_edges) return 0;
  const std::size_t closed = mesh.open_edges - joined.open_edges;
  joined.degenerate_triangles += static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 0));
  mesh = std::move(joined);
  return closed;
}

std::size_t drop_fins(PartMesh& mesh) {
  constexpr int kRounds = 8;  // a fin on a fin
  double budget = kNegligible * std::abs(enclosed_volume(mesh));
  std::size_t dropped = 0;
  for (int round = 0; round < kRounds; ++round) {
    const std::size_t now = drop_fins_once(mesh, budget);
    if (now == 0) break;
    dropped += now;
  }
  return dropped;
}

std::size_t drop_loose_sheets(PartMesh& mesh) {
  const std::vector<std::uint32_t> degree = edge_degrees(mesh);
  std::vector<std::uint8_t> open(mesh.shell_count, 0);
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    for (const std::uint32_t edge : mesh.edges[t])
      if (degree[edge] % 2 != 0) open[mesh.shell[t]] = 1;
  }
  PartMesh rest = mesh;
  std::vector<std::uint8_t> keep(mesh.corners.size());
  for (std::uint32_t t = 0; t < keep.size(); ++t) keep[t] = !open[mesh.shell[t]];
  keep_triangles(rest, keep);
  std::vector<std::uint32_t> group(mesh.shell);
  for (std::uint32_t& shell : group)
    if (!open[shell]) shell = kNoTriangle;
  double bound = 0;
  for (const auto& [shell, volume] : cone_volumes(mesh, group)) bound += volume;
  if (rest.corners.empty() || bound > kNegligible * std::abs(enclosed_volume(rest))) return 0;
  mesh = std::move(rest);
  return static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 0));
}

}  // namespace flexel::voxelize
