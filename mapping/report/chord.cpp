// Points along the edges of a triangle, and inside it, are mapped and their distance from the plane of the
// mapped corners is taken; sliding within the plane does not change the shape. A sharp edge belongs to
// triangles in two planes, so bending in either direction is seen.
#include "mapping/report/chord.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "formats/lattice/fragments_of_body.h"
#include "mapping/methods/space_map.h"

namespace flexel::mapping {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr double kLongEdge = 2;        // spacings: shorter edges are not sampled
constexpr double kMostOnEdge = 16;     // pairs of pieces, each of two spacings or more
constexpr double kMostInside = 3;      // thirds of a triangle's sides, each in as many pieces
constexpr double kNoise = 1e-9;        // of the part's diagonal: rounding
constexpr double kGoodShare = 2.5e-3;  // what sufficient_edge() leaves

// Even, so that the middle is among the points.
int pieces_of_edge(double spacings) {
  return 2 * static_cast<int>(std::clamp(std::ceil(spacings / (2 * kLongEdge)), 1.0, kMostOnEdge));
}
// Divisible by three, so that the centroid is.
int pieces_inside(double spacings) {
  return 3 * static_cast<int>(std::clamp(std::ceil(spacings / (3 * kLongEdge)), 1.0, kMostInside));
}

struct LongTriangle {
  Triangle corners{};
  std::uint32_t polygon = 0, part = 0;
  double longest = 0, height = 0;  // m
};

struct Missed {
  double largest = 0;  // m
  Vec3 at = Vec3::Zero();
  double displacement = 0;  // m, the largest of a point
};

double longest_edge(const std::vector<Vec3>& at, std::span<const std::uint32_t> corners) {
  double longest = 0;
  for (std::size_t i = 0; i < corners.size(); ++i)
    longest = std::max(longest, (at[corners[i]] - at[corners[(i + 1) % corners.size()]]).norm());
  return longest;
}

// Whether the corners are held by elements that a fracture has parted.
bool spans_fracture(const Components& fragments, const MapResult& result, const Triangle& corners) {
  const auto fragment = [&](int c) { return fragments.of[result.frame_of(corners[c]).elements[0]]; };
  return fragment(0) != fragment(1) || fragment(0) != fragment(2);
}

// Triangles with a long edge.
std::vector<LongTriangle> long_triangles(const Body& body, const MapResult& result) {
  const Surface& surface = body.surface;
  std::vector<double> least;  // (parts) m
  for (const Part& part : body.parts) least.push_back(kLongEdge * part.lattice.spacing.minCoeff());
  // The diagonal of a polygon is at most half its perimeter: most meshes need no triangulation.
  const auto may_be_long = [&](std::size_t p) {
    return longest_edge(surface.vertices, surface.polygon(p)) *
               static_cast<double>(surface.polygon(p).size()) / (surface.polygon(p).size() == 3 ? 3 : 2) >
           least[surface.polygon_part(p)];
  };
  bool any = false;
  for (std::size_t p = 0; p < surface.polygon_count() && !any; ++p) any = may_be_long(p);
  std::vector<LongTriangle> found;
  if (!any) return found;
  std::optional<Components> fragments;
  if (may_be_broken(body)) fragments = find_components(body, element_adjacency(body));
  const Triangles triangles = triangulate(surface);
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    LongTriangle each;
    each.corners = triangles.corners[t];
    each.polygon = triangles.polygon[t];
    each.part = surface.polygon_part(each.polygon);
    each.longest = longest_edge(surface.vertices, each.corners);
    if (!(each.longest > least[each.part])) continue;
    if (fragments && spans_fracture(*fragments, result, each.corners)) continue;
    const auto& [a, b, c] = each.corners;
    const std::vector<Vec3>& at = surface.vertices;
    each.height = (at[b] - at[a]).cross(at[c] - at[a]).norm() / each.longest;
    found.push_back(each);
  }
  return found;
}

// Looks at the points of one triangle after the other.
class Look {
 public:
  Look(const Body& body, const SpaceMap& map) : body_(body), probe_(map) {}

  Missed operator()(const LongTriangle& triangle) {
    Missed found;
    const double spacing = body_.parts[triangle.part].lattice.spacing.minCoeff();
    std::array<Vec3, 3> rest, moved;
    for (std::size_t i = 0; i < 3; ++i) {
      rest.at(i) = body_.surface.vertices[triangle.corners.at(i)];
      moved.at(i) = probe_.at(rest.at(i), triangle.part, triangle.polygon).position;
    }
    const Vec3 area = (moved[1] - moved[0]).cross(moved[2] - moved[0]);
    if (!(area.norm() > 0) || !area.allFinite()) return found;
    const Vec3 normal = area.normalized();
    const auto look = [&](double u, double v) {
      const Vec3 x = rest[0] + u * (rest[1] - rest[0]) + v * (rest[2] - rest[0]);
      const SpaceMap::Value value = probe_.at(x, triangle.part, triangle.polygon);
      if (!value.heard || !value.position.allFinite()) return;
      found.displacement = std::max(found.displacement, (value.position - x).norm());
      const double distance = std::abs(normal.dot(value.position - moved[0]));
      if (distance <= found.largest) return;
      found.largest = distance;
      found.at = x;
    };
    const std::array<std::array<double, 2>, 3> corner = {{{0, 0}, {1, 0}, {0, 1}}};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto &from = corner.at(i), &to = corner.at((i + 1) % 3);
      const double length = (rest.at((i + 1) % 3) - rest.at(i)).norm() / spacing;
      if (!(length > kLongEdge)) continue;
      const int n = pieces_of_edge(length);
      for (int k = 1; k < n; ++k) {
        const double s = static_cast<double>(k) / n;
        look(from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]));
      }
    }
    if (!(triangle.height > kLongEdge * spacing)) return found;
    const int n = pieces_inside(triangle.longest / spacing);
    for (int i = 1; i < n - 1; ++i)
      for (int j = 1; i + j < n; ++j) look(static_cast<double>(i) / n, static_cast<double>(j) / n);
    return found;
  }

 private:
  const Body& body_;
  SpaceMap::Probe probe_;
};

}  // namespace

ChordError chord_error(const Body& body, const MapResult& result) {
  constexpr std::size_t kTrianglesAtATime = 64;
  ChordError error;
  for (const Vec3& each : result.displacement)
    if (each.allFinite()) error.largest_displacement = std::max(error.largest_displacement, each.norm());
  if (body.position == body.rest) return error;
  const std::vector<LongTriangle> triangles = long_triangles(body, result);
  if (triangles.empty()) return error;
  const SpaceMap map(body);
  std::vector<Missed> found(triangles.size());
  parallel_chunks(triangles.size(), kTrianglesAtATime, [&](std::size_t begin, std::size_t end) {
    Look look(body, map);
    for (std::size_t t = begin; t < end; ++t) found[t] = look(triangles[t]);
  });
  Box box;
  for (std::size_t t = 0; t < found.size(); ++t) {
    for (const std::uint32_t v : triangles[t].corners) box.add(body.surface.vertices[v]);
    error.largest_displacement = std::max(error.largest_displacement, found[t].displacement);
    if (found[t].largest <= error.largest) continue;
    error.largest = found[t].largest;
    error.at = found[t].at;
    error.longest_edge = triangles[t].longest;
  }
  const double least = std::max(kCoarseShare * error.largest_displacement, kNoise * box.size().norm());
  for (const Missed& each : found) error.coarse_triangles += each.largest > least;
  return error;
}

double sufficient_edge(const ChordError& error) {
  return error.longest_edge * std::sqrt(std::min(1.0, kGoodShare / error.share()));
}

}  // namespace flexel::mapping
