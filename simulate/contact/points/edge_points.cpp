// Corners first, then points along the edges; one that another is too near to is left out.
#include "simulate/contact/points/edge_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace flexel::simulate {
namespace {

constexpr double kSharpEdge = 0.866;  // cosine of 30 degrees between the normals of the faces
constexpr double kSpacing = 1;        // of the points along an edge, in spacings
constexpr double kCrowded = 0.7;      // nearer than this to another one, in spacings, a point is left out

struct Edge {
  std::array<std::uint32_t, 2> ends{};  // welded vertices
  std::array<Vec3, 2> normals{Vec3::Zero(), Vec3::Zero()};
  std::uint32_t polygon = 0;
};

// Vertices at one place are one.
std::vector<std::uint32_t> weld(const std::vector<Vec3>& vertices) {
  std::map<std::array<double, 3>, std::uint32_t> first;
  std::vector<std::uint32_t> welded(vertices.size());
  for (std::uint32_t v = 0; v < vertices.size(); ++v)
    welded[v] = first.try_emplace({vertices[v].x(), vertices[v].y(), vertices[v].z()}, v).first->second;
  return welded;
}

std::vector<Edge> sharp_edges(const Surface& surface, const std::vector<std::uint8_t>& wanted) {
  struct EdgeSide {
    std::uint32_t triangle = 0, apex = 0;
  };
  const Triangles triangles = triangulate(surface);
  const std::vector<std::uint32_t> welded = weld(surface.vertices);
  using EdgeKey = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;  // part, ends
  std::vector<std::pair<EdgeKey, EdgeSide>> sides;
  for (std::uint32_t t = 0; t < triangles.corners.size(); ++t) {
    const std::uint32_t part = surface.polygon_part(triangles.polygon[t]);
    if (!wanted[part]) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t a = welded[triangles.corners[t][c]], b = welded[triangles.corners[t][(c + 1) % 3]];
      sides.push_back(
          {{part, std::min(a, b), std::max(a, b)}, {t, welded[triangles.corners[t][(c + 2) % 3]]}});
    }
  }
  std::stable_sort(sides.begin(), sides.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  const auto normal = [&](std::uint32_t t) {
    const auto& corners = triangles.corners[t];
    const Vec3& origin = surface.vertices[corners[0]];
    return Vec3((surface.vertices[corners[1]] - origin).cross(surface.vertices[corners[2]] - origin))
        .normalized();
  };
  std::vector<Edge> edges;
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].first != sides[i + 1].first) continue;
    if (i + 2 < sides.size() && sides[i + 2].first == sides[i].first) continue;  // not two faces
    const EdgeSide &one = sides[i].second, &two = sides[i + 1].second;
    Edge edge;
    edge.ends = {std::get<1>(sides[i].first), std::get<2>(sides[i].first)};
    edge.normals = {normal(one.triangle), normal(two.triangle)};
    edge.polygon = triangles.polygon[one.triangle];
    const Vec3 across = surface.vertices[two.apex] - surface.vertices[edge.ends[0]];
    const bool convex = across.dot(edge.normals[0]) < 0;
    if (convex && edge.normals[0].dot(edge.normals[1]) < kSharpEdge) edges.push_back(edge);
  }
  return edges;
}

class Sampler {
 public:
  Sampler(const Problem& problem, std::vector<Edge> edges) : problem_(problem), edges_(std::move(edges)) {}

  std::vector<ContactPoint> operator()() {
    // corners first, for they are the outermost
    std::map<std::array<std::uint32_t, 2>, std::vector<std::size_t>> at;  // by part and vertex
    for (std::size_t e = 0; e < edges_.size(); ++e)
      for (const std::uint32_t end : edges_[e].ends) at[{part_of(edges_[e].polygon), end}].push_back(e);
    for (const bool corners : {true, false})
      for (const auto& [vertex, edges] : at) {
        if ((edges.size() > 2) != corners) continue;
        std::vector<Vec3> normals;
        for (const std::size_t e : edges)
          normals.insert(normals.end(), edges_[e].normals.begin(), edges_[e].normals.end());
        add(problem_.body.surface.vertices[vertex[1]], normals, edges_[edges.front()].polygon);
      }
    for (const Edge& edge : edges_) {
      const Vec3 &a = problem_.body.surface.vertices[edge.ends[0]],
                 &b = problem_.body.surface.vertices[edge.ends[1]];
      const double width = width_of(edge.polygon);
      const auto pieces = static_cast<int>(std::ceil((b - a).norm() / (kSpacing * width)));
      for (int i = 1; i < pieces; ++i)
        add(a + (b - a) * (static_cast<double>(i) / pieces), {edge.normals[0], edge.normals[1]},
            edge.polygon);
    }
    return std::move(points_);
  }

 private:
  [[nodiscard]] std::uint32_t part_of(std::uint32_t polygon) const {
    return problem_.body.surface.polygon_part(polygon);
  }
  [[nodiscard]] double width_of(std::uint32_t polygon) const {
    return problem_.body.parts[part_of(polygon)].lattice.spacing.mean();
  }

  void add(const Vec3& position, const std::vector<Vec3>& normals, std::uint32_t polygon) {
    const double width = width_of(polygon);
    const std::uint32_t part = part_of(polygon);
    Vec3 mean = Vec3::Zero();
    for (const Vec3& each : normals) mean += each;
    if (!(mean.norm() > 1e-3) || crowded(part, position, width)) return;
    mean.normalize();
    const auto at = carrier_on_surface(problem_, polygon, position, mean);
    if (!at) return;
    double widest = 1;
    for (const Vec3& each : normals) widest = std::min(widest, mean.dot(each));
    ContactPoint made;
    made.shape = ContactShape::edge;
    made.part = part;
    made.at = *at;
    made.rest = position;
    made.normal = mean;
    made.area = 0.5 * kSpacing * width * width;
    made.depth = 0.5 * width;
    made.width = width;
    made.facing_from = widest - 0.3;
    made.facing_fully = widest - 0.05;
    points_.push_back(made);
  }

  // Whether another point is near; else the place is entered, in cubes of a spacing.
  bool crowded(std::uint32_t part, const Vec3& position, double width) {
    std::array<std::int64_t, 4> cube{part, 0, 0, 0};
    for (int axis = 0; axis < 3; ++axis)
      cube[static_cast<std::size_t>(axis) + 1] =
          static_cast<std::int64_t>(std::floor(position[axis] / width));
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto found =
          taken_.find({cube[0], cube[1] + n % 3 - 1, cube[2] + n / 3 % 3 - 1, cube[3] + n / 9 - 1});
      if (found == taken_.end()) continue;
      for (const Vec3& other : found->second)
        if ((other - position).norm() < kCrowded * width) return true;
    }
    taken_[cube].push_back(position);
    return false;
  }

  const Problem& problem_;
  std::vector<Edge> edges_;
  std::map<std::array<std::int64_t, 4>, std::vector<Vec3>> taken_;
  std::vector<ContactPoint> points_;
};

}  // namespace

std::vector<ContactPoint> edge_points(const Problem& problem, const std::vector<std::uint8_t>& parts) {
  std::vector<std::uint8_t> wanted = parts;
  for (std::size_t p = 0; p < wanted.size(); ++p)
    if (problem.body.parts[p].placement != Placement::corner) wanted[p] = 0;
  return Sampler(problem, sharp_edges(problem.body.surface, wanted))();
}

}  // namespace flexel::simulate
