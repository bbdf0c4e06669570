// Loops are followed along edges with one triangle. Where the path meets itself a loop is split off, so holes
// that share a vertex are separate.
#include "voxelize/heal/heal_holes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "base/stop.h"
#include "formats/part/topology.h"
#include "voxelize/heal/heal_cgal.h"
#include "voxelize/heal/heal_mesh.h"
#include "voxelize/heal/orientation.h"

namespace flexel::voxelize {
namespace {

struct OpenEdge {
  std::uint32_t a = 0, b = 0;
  std::uint32_t triangle = 0, far = 0;  // its triangle and that one's third vertex
  bool used = false;
};

class LoopWalker {
 public:
  explicit LoopWalker(const PartMesh& mesh) {
    const std::vector<std::uint32_t> degree = edge_degrees(mesh);
    for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
      for (int e = 0; e < 3; ++e) {
        if (degree[mesh.edges[t][e]] != 1) continue;
        const Corners& c = mesh.corners[t];
        for (const std::uint32_t v : {c[e], c[(e + 1) % 3]})
          at_[v].push_back(static_cast<std::uint32_t>(edges_.size()));
        edges_.push_back({c[e], c[(e + 1) % 3], t, c[(e + 2) % 3]});
      }
  }

  // Loops as numbers of open edges, in order; the edges that form none are left over.
  std::vector<std::vector<std::uint32_t>> walk() {
    std::vector<std::vector<std::uint32_t>> loops;
    for (std::uint32_t start = 0; start < edges_.size(); ++start)
      if (!edges_[start].used) walk_from(start, loops);
    return loops;
  }

  [[nodiscard]] const OpenEdge& edge(std::uint32_t n) const { return edges_[n]; }
  [[nodiscard]] std::size_t edge_count() const { return edges_.size(); }

 private:
  void walk_from(std::uint32_t start, std::vector<std::vector<std::uint32_t>>& loops) {
    std::vector<std::uint32_t> path, vertices{edges_[start].a};
    std::map<std::uint32_t, std::size_t> place{{edges_[start].a, 0}};
    for (std::uint32_t next = start; next != kNoTriangle; next = unused_at(vertices.back())) {
      OpenEdge& edge = edges_[next];
      edge.used = true;
      const std::uint32_t to = edge.a == vertices.back() ? edge.b : edge.a;
      path.push_back(next);
      if (const auto met = place.find(to); met != place.end()) {
        const std::size_t from = met->second;
        loops.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(from), path.end());
        path.resize(from);
        while (vertices.size() > from + 1) {
          place.erase(vertices.back());
          vertices.pop_back();
        }
      } else {
        place[to] = vertices.size();
        vertices.push_back(to);
      }
    }
  }

  [[nodiscard]] std::uint32_t unused_at(std::uint32_t vertex) const {
    for (const std::uint32_t n : at_.at(vertex))
      if (!edges_[n].used) return n;
    return kNoTriangle;
  }

  std::vector<OpenEdge> edges_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> at_;
};

double area(const std::vector<Vec3>& points, const Corners& c) {
  return (points[c[1]] - points[c[0]]).cross(points[c[2]] - points[c[0]]).norm() / 2;
}

// A loop with its points and the far corners across its edges.
struct Loop {
  std::vector<std::uint32_t> vertices;
  std::vector<Vec3> points, across;
  int along = 0;  // edges run by their triangles as the loop runs them, less those run the other way
};

Loop loop_of(const PartMesh& mesh, const LoopWalker& walker, const std::vector<std::uint32_t>& edges) {
  Loop loop;
  for (std::size_t n = 0; n < edges.size(); ++n) {
    const OpenEdge& edge = walker.edge(edges[n]);
    const OpenEdge& next = walker.edge(edges[(n + 1) % edges.size()]);
    const std::uint32_t from = edge.b == next.a || edge.b == next.b ? edge.a : edge.b;
    loop.along += from == edge.a ? 1 : -1;
    loop.vertices.push_back(from);
    loop.points.push_back(mesh.world[from]);
    loop.across.push_back(mesh.world[edge.far]);
  }
  return loop;
}

std::vector<Corners> closing_triangles(const Loop& loop) {
  constexpr std::size_t kLongest = 4000;  // edges: the search grows with the cube of them
  if (loop.points.size() < 3 || loop.points.size() > kLongest) return {};
  if (loop.points.size() == 3) return {{0, 1, 2}};
  return close_loop(loop.points, loop.across);
}

// The angle at a rim edge between the surface and what closes it is judged by the directions away from the
// edge, which do not depend on how triangles face: straight on is opposite.
bool goes_on(const Vec3& from, const Vec3& to, const Vec3& here, const Vec3& there) {
  constexpr double kSmooth = .7;  // cosine of 45 degrees
  const Vec3 along = (to - from).normalized();
  const auto away = [&](const Vec3& point) {
    return Vec3((point - from) - (point - from).dot(along) * along).normalized();
  };
  return -away(here).dot(away(there)) >= kSmooth;
}

// How far the shape of a hole is from following from its rim: the share of the rim along which what closes it
// does not go on smoothly; 0 for what is flat, as a lost face is, and for a single triangle.
double unknown_share(const Loop& loop, const std::vector<Corners>& closing) {
  constexpr double kFlat = .98;
  if (closing.size() <= 1) return 0;
  const auto n = static_cast<std::uint32_t>(loop.points.size());
  double rim = 0, smooth = 0, sum = 0;
  Vec3 vector = Vec3::Zero();
  for (Corners c : closing) {
    std::sort(c.begin(), c.end());  // as the loop runs
    const Vec3 normal = (loop.points[c[1]] - loop.points[c[0]]).cross(loop.points[c[2]] - loop.points[c[0]]);
    vector += normal;
    sum += normal.norm();
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = c[e], b = c[(e + 1) % 3];
      if ((a + 1) % n != b) continue;
      const double length = (loop.points[b] - loop.points[a]).norm();
      rim += length;
      if (goes_on(loop.points[a], loop.points[b], loop.across[a], loop.points[c[(e + 2) % 3]]))
        smooth += length;
    }
  }
  return vector.norm() >= kFlat * sum || !(rim > 0) ? 0 : 1 - smooth / rim;
}

// Volume [m^3] of the part once `closing` is in it, whichever way its triangles face now.
double volume_with(PartMesh mesh, const std::vector<Corners>& closing) {
  mesh.corners.insert(mesh.corners.end(), closing.begin(), closing.end());
  mesh.polygon.resize(mesh.corners.size(), kNoPolygon);
  number_edges(mesh);
  repair_orientation(mesh);
  return std::abs(enclosed_volume(mesh));
}

// A hole before it is decided on, in the mesh's vertices.
Hole hole_at(const Loop& loop) {
  Hole hole{.loop = loop.vertices};
  Box box;
  for (const Vec3& point : loop.points) {
    box.add(point);
    hole.centre += point / static_cast<double>(loop.points.size());
  }
  hole.width = box.diagonal();
  return hole;
}

// Closes the holes that are filled, but those of which more is unknown than the part's volume leaves room for.
// `closings` (holes) their triangles, `reaches` (holes) m^3, what may be missing beyond them.
void close_holes(const std::vector<std::vector<Corners>>& closings, const std::vector<double>& reaches,
                 const std::vector<Corners>& all, PartMesh& mesh, FilledHoles& result) {
  const bool any_uncertain = std::any_of(reaches.begin(), reaches.end(), [](double r) { return r > 0; });
  double left = any_uncertain ? kUncertain * volume_with(mesh, all) : 0;
  for (std::size_t n = 0; n < closings.size(); ++n) {
    Hole& hole = result.holes[n];
    hole.uncertain = hole.filled && reaches[n] > left;
    hole.filled = hole.filled && !hole.uncertain;
    if (!hole.filled) continue;
    left -= reaches[n];
    result.triangles += closings[n].size();
    mesh.corners.insert(mesh.corners.end(), closings[n].begin(), closings[n].end());
    mesh.polygon.resize(mesh.corners.size(), kNoPolygon);
  }
  if (result.triangles > 0) number_edges(mesh);
}

}  // namespace

FilledHoles fill_holes(PartMesh& mesh) {
  FilledHoles result;
  LoopWalker walker(mesh);
  std::vector<double> shell_area(mesh.shell_count, 0), filled_area(mesh.shell_count, 0);
  std::set<Corners> at_holes;  // triangles that have an open edge
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    shell_area[mesh.shell[t]] += area(mesh.world, mesh.corners[t]);
  for (std::uint32_t n = 0; n < walker.edge_count(); ++n)
    at_holes.insert(sorted_corners(mesh.corners[walker.edge(n).triangle]));
  const double whole = std::accumulate(shell_area.begin(), shell_area.end(), 0.);
  std::size_t in_loops = 0;
  std::vector<std::vector<Corners>> closings;  // (holes)
  std::vector<double> reaches;  // (holes) m^3, what may be missing beyond the triangles that close it
  std::vector<Corners> all;
  for (const auto& edges : walker.walk()) {
    check_stop();
    const Loop loop = loop_of(mesh, walker, edges);
    Hole hole = hole_at(loop);
    in_loops += edges.size();
    std::vector<Corners> closing = closing_triangles(loop);
    const double unknown = unknown_share(loop, closing);
    double sum = 0;
    bool doubles = false;  // a triangle that is there already: a sheet, not a hole
    for (Corners& c : closing) {
      sum += area(loop.points, c);
      std::sort(c.begin(), c.end());  // now it runs as the loop does
      if (loop.along > 0) std::swap(c[1], c[2]);
      for (std::uint32_t& v : c) v = loop.vertices[v];
      doubles = doubles || at_holes.count(sorted_corners(c)) > 0;
    }
    const std::uint32_t shell = mesh.shell[walker.edge(edges[0]).triangle];
    hole.share = closing.empty() || doubles ? 1 : sum / shell_area[shell];
    hole.shell_share = shell_area[shell] / whole;
    hole.filled = hole.share <= (closing.size() == 1 ? kLargestTriangle : kLargestHole) &&
                  filled_area[shell] + sum <= kAllHoles * shell_area[shell];
    reaches.push_back(hole.filled ? sum * hole.width * unknown : 0);
    if (hole.filled) {
      filled_area[shell] += sum;
      all.insert(all.end(), closing.begin(), closing.end());
    }
    closings.push_back(std::move(closing));
    result.holes.push_back(std::move(hole));
  }
  result.stray_edges = walker.edge_count() - in_loops;
  close_holes(closings, reaches, all, mesh, result);
  return result;
}

}  // namespace flexel::voxelize
