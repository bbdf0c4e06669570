// Edges are found by a counting sort: every half-edge goes to the bucket of its lower corner, the buckets are
// sorted by the higher corner in parallel, and equal neighbours in a bucket share an edge. Shells and
// dihedral regions are connected components by union-find whose root is always the lowest triangle, so that
// numbering in order of first triangle is one sweep.
#include "formats/part/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/bucket.h"
#include "base/disjoint_sets.h"
#include "base/math/weld.h"
#include "base/parallel.h"

namespace flexel {
namespace {

using Corners = std::array<std::uint32_t, 3>;

bool degenerate(const Corners& c) {
  return c[0] == c[1] || c[1] == c[2] || c[2] == c[0];
}

// Half-edge 3 t + i runs from corner i of triangle t to the next. Those of bucket v have v as their lower
// corner.
using HalfEdges = Buckets<std::uint64_t>;  // higher corner << 32 | half-edge

HalfEdges bucket_half_edges(const std::vector<Corners>& corners, std::size_t vertex_count) {
  return sort_into_buckets<std::uint64_t>(vertex_count, [&](const auto& use) {
    for (std::size_t t = 0; t < corners.size(); ++t) {
      if (degenerate(corners[t])) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto [low, high] = std::minmax(corners[t][i], corners[t][(i + 1) % 3]);
        use(low, static_cast<std::uint64_t>(high) << 32 | (3 * t + i));
      }
    }
  });
}

// A few triangles of many vertices (one of a hundred thousand parts): their vertices are numbered from 0, in the same order.
std::size_t number_anew(std::vector<Corners>& corners) {
  std::vector<std::uint32_t> used;
  for (const Corners& each : corners) used.insert(used.end(), each.begin(), each.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (Corners& each : corners)
    for (std::uint32_t& v : each)
      v = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
  return used.size();
}

// Edges counted in a range of buckets, and the pairs of triangles that meet at a non-manifold edge.
struct EdgeTally {
  std::size_t open = 0, non_manifold = 0, misoriented = 0;
  std::vector<std::array<std::uint32_t, 2>> joined;
};

// One edge: the half-edges [begin, end) that share both corners.
void pair_edge(const std::uint64_t* begin, const std::uint64_t* end, const std::vector<Corners>& corners,
               Topology& result, EdgeTally& tally) {
  const auto half_edge = [](std::uint64_t member) { return static_cast<std::uint32_t>(member); };
  if (end - begin == 1) {
    ++tally.open;
  } else if (end - begin == 2) {
    const std::uint32_t a = half_edge(begin[0]), b = half_edge(begin[1]);
    result.neighbour[a / 3][a % 3] = b / 3;
    result.neighbour[b / 3][b % 3] = a / 3;
    if (corners[a / 3][a % 3] == corners[b / 3][b % 3]) ++tally.misoriented;
  } else {
    ++tally.non_manifold;
    for (const std::uint64_t* m = begin + 1; m < end; ++m)
      tally.joined.push_back({half_edge(*begin) / 3, half_edge(*m) / 3});
  }
}

// Fills `neighbour` and the counts; returns the pairs joined by non-manifold edges.
std::vector<std::array<std::uint32_t, 2>> pair_edges(const std::vector<Corners>& corners, HalfEdges& edges,
                                                     Topology& result) {
  constexpr std::size_t kGrain = 1 << 14;
  const std::size_t n = edges.begin.size() - 1;
  std::vector<EdgeTally> tallies(n / kGrain + 1);
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    EdgeTally& tally = tallies[begin / kGrain];
    for (std::size_t v = begin; v < end; ++v) {
      std::uint64_t* first = edges.values.data() + edges.begin[v];
      std::uint64_t* last = edges.values.data() + edges.begin[v + 1];
      std::sort(first, last);
      for (std::uint64_t* run = first; run != last;) {
        std::uint64_t* stop = run;
        while (stop != last && *stop >> 32 == *run >> 32) ++stop;
        pair_edge(run, stop, corners, result, tally);
        run = stop;
      }
    }
  });
  std::vector<std::array<std::uint32_t, 2>> joined;
  for (const EdgeTally& tally : tallies) {
    result.open_edges += tally.open;
    result.non_manifold_edges += tally.non_manifold;
    result.misoriented_edges += tally.misoriented;
    joined.insert(joined.end(), tally.joined.begin(), tally.joined.end());
  }
  return joined;
}

void number_shells(const std::vector<Corners>& welded_corners,
                   const std::vector<std::array<std::uint32_t, 2>>& joined, Topology& result) {
  const std::size_t n = welded_corners.size();
  DisjointSets sets(n);
  for (std::uint32_t t = 0; t < n; ++t)
    for (const std::uint32_t u : result.neighbour[t])
      if (u != kNoTriangle && u > t) sets.unite(t, u);
  for (const auto& [a, b] : joined) sets.unite(a, b);
  result.shell.assign(n, kNoTriangle);
  for (std::uint32_t t = 0; t < n; ++t) {
    if (degenerate(welded_corners[t])) {
      ++result.degenerate_triangles;
      continue;
    }
    const std::uint32_t root = sets.root(t);
    result.shell[t] = root == t ? result.shell_count++ : result.shell[root];
  }
}

// Unit normals, and which of them mean something: the direction of a triangle lower than a millionth of the
// diagonal is noise of single-precision coordinates.
struct Normals {
  std::vector<Vec3> unit;
  std::vector<std::uint8_t> reliable;
};

Normals triangle_normals(const std::vector<Vec3>& vertices, const std::vector<Corners>& corners) {
  constexpr double kNoise = 1e-6;
  const double lowest = kNoise * bounding_box(vertices).diagonal();
  Normals normals{std::vector<Vec3>(corners.size()), std::vector<std::uint8_t>(corners.size())};
  parallel_for_each(corners.size(), [&](std::size_t t) {
    const Vec3 &a = vertices[corners[t][0]], &b = vertices[corners[t][1]], &c = vertices[corners[t][2]];
    const Vec3 area = (b - a).cross(c - a);
    const double longest =
        std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
    const double length = area.norm();
    normals.reliable[t] = length > lowest * longest;
    normals.unit[t] = length > 0 ? Vec3(area / length) : Vec3(Vec3::Zero());
  });
  return normals;
}

// A needle lies flat on the triangle across its longest edge: the normal it should be judged by is that
// one's.
Vec3 judged_normal(const std::vector<Vec3>& vertices, const std::vector<Corners>& corners,
                   const Topology& topology, const Normals& normals, std::uint32_t t) {
  constexpr int kMostNeedles = 64;  // in a row, before giving up
  const std::uint32_t start = t;
  for (int step = 0; step < kMostNeedles && !normals.reliable[t]; ++step) {
    std::array<double, 3> squared{};
    for (std::size_t i = 0; i < 3; ++i)
      squared[i] = (vertices[corners[t][(i + 1) % 3]] - vertices[corners[t][i]]).squaredNorm();
    const auto longest = std::max_element(squared.begin(), squared.end()) - squared.begin();
    const std::uint32_t across = topology.neighbour[t][longest];
    if (across == kNoTriangle) break;
    t = across;
  }
  return normals.unit[normals.reliable[t] ? t : start];
}

// True when both triangles run their common edge in the same direction, so that their normals oppose each
// other. Positions are compared because corners need not be welded.
bool misoriented(const std::vector<Vec3>& vertices, const std::vector<Corners>& corners,
                 const Topology& topology, std::uint32_t t, std::size_t edge, std::uint32_t u) {
  const Vec3 &from = vertices[corners[t][edge]], &to = vertices[corners[t][(edge + 1) % 3]];
  for (std::size_t j = 0; j < 3; ++j)
    if (topology.neighbour[u][j] == t && vertices[corners[u][j]] == from &&
        vertices[corners[u][(j + 1) % 3]] == to)
      return true;
  return false;
}

}  // namespace

std::vector<std::uint32_t> weld(const std::vector<Vec3>& vertices) {
  return first_equal(vertices.size(), [&](std::size_t i) {
    return position_key(vertices[i].x(), vertices[i].y(), vertices[i].z());
  });
}

Topology topology(const std::vector<Corners>& corners, const std::vector<std::uint32_t>& welded) {
  std::vector<Corners> welded_corners(corners.size());
  parallel_for_each(corners.size(), [&](std::size_t t) {
    for (std::size_t i = 0; i < 3; ++i) welded_corners[t][i] = welded[corners[t][i]];
  });
  const std::size_t vertices =
      9 * corners.size() < welded.size() ? number_anew(welded_corners) : welded.size();
  Topology result;
  result.neighbour.assign(corners.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  HalfEdges edges = bucket_half_edges(welded_corners, vertices);
  const auto joined = pair_edges(welded_corners, edges, result);
  number_shells(welded_corners, joined, result);
  return result;
}

double signed_volume(const std::vector<Vec3>& vertices, const std::vector<Corners>& corners) {
  if (corners.empty()) return 0;
  const Vec3 origin = vertices[corners[0][0]];
  return parallel_sum<double>(corners.size(),
                              [&](std::size_t t) {
                                const Vec3 a = vertices[corners[t][0]] - origin,
                                           b = vertices[corners[t][1]] - origin;
                                return a.dot(b.cross(vertices[corners[t][2]] - origin));
                              }) /
         6;
}

std::vector<std::uint32_t> dihedral_regions(const std::vector<Vec3>& vertices,
                                            const std::vector<Corners>& corners, const Topology& topology,
                                            double degrees) {
  const std::size_t n = corners.size();
  const double least_cosine = std::cos(degrees * std::numbers::pi / 180);
  Normals normals = triangle_normals(vertices, corners);
  std::vector<Vec3> judged(n);
  parallel_for_each(n, [&](std::size_t t) {
    judged[t] = normals.reliable[t]
                    ? normals.unit[t]
                    : judged_normal(vertices, corners, topology, normals, static_cast<std::uint32_t>(t));
  });
  std::vector<std::uint8_t> smooth(n);  // bit i: edge i does not bound a region
  parallel_for_each(n, [&](std::size_t index) {
    const auto t = static_cast<std::uint32_t>(index);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t u = topology.neighbour[t][i];
      if (u == kNoTriangle || u < t) continue;
      const double cosine = judged[t].dot(judged[u]);
      if (std::max(cosine, -cosine) < least_cosine) continue;
      const double oriented = misoriented(vertices, corners, topology, t, i, u) ? -cosine : cosine;
      if (oriented >= least_cosine) smooth[t] |= static_cast<std::uint8_t>(1u << i);
    }
  });
  DisjointSets sets(n);
  for (std::uint32_t t = 0; t < n; ++t)
    for (std::size_t i = 0; i < 3; ++i)
      if (smooth[t] >> i & 1) sets.unite(t, topology.neighbour[t][i]);
  // Degenerate triangles: those at the front go with the first that is not, others with the one before.
  const auto whole =
      std::find_if(topology.shell.begin(), topology.shell.end(), [](auto s) { return s != kNoTriangle; });
  if (whole != topology.shell.end())
    sets.unite(0, static_cast<std::uint32_t>(whole - topology.shell.begin()));
  for (std::uint32_t t = 1; t < n; ++t)
    if (topology.shell[t] == kNoTriangle) sets.unite(t, t - 1);
  std::vector<std::uint32_t> region(n);
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < n; ++t) {
    const std::uint32_t root = sets.root(t);
    region[t] = root == t ? count++ : region[root];
  }
  return region;
}

}  // namespace flexel
