// Patches: surface_points() sorted by cell and place in it, gathered greedily by their normals.
#include "simulate/contact/points/contact_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/math/distance.h"
#include "simulate/contact/points/broad_phase.h"
#include "simulate/contact/points/edge_points.h"
#include "simulate/contact/points/merged_patches.h"
#include "simulate/matter/surface_points.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr double kSamePatch = 0.94;  // cosine of 20 degrees
constexpr double kBallReach = 1.4;   // spacings, from an element to points of the surface that may be nearest
constexpr double kLeastPatch = 1e-5;  // of h^2; slivers carry nothing worth their time

struct Piece {  // of surface, in its cell or, with more patches, share of it
  const SurfacePoint* point = nullptr;
  Index3 share{};
  [[nodiscard]] auto key() const { return std::tie(point->at.elements, share); }
};

ContactPoint patch_of(const std::vector<const SurfacePoint*>& members, std::uint32_t part, double width) {
  ContactPoint made;
  made.part = part;
  made.at.elements = members.front()->at.elements;
  made.at.count = members.front()->at.count;
  made.width = width;
  made.depth = 0.5 * width;
  Vec3 turned = Vec3::Zero();
  for (const SurfacePoint* each : members) {
    const double area = each->area_vector.norm();
    made.area += area;
    turned += each->area_vector;
    made.rest += area * each->position;
    for (std::size_t a = 0; a < 8; ++a) made.at.weights[a] += area * each->at.weights[a];
  }
  made.rest /= made.area;
  for (double& weight : made.at.weights) weight /= made.area;
  made.normal = turned.normalized();
  return made;
}

// The patches of the pieces [begin, end), all in one share of a cell.
void gather(std::vector<Piece>::const_iterator begin, std::vector<Piece>::const_iterator end,
            std::uint32_t part, double width, std::vector<ContactPoint>& points) {
  std::vector<std::pair<Vec3, std::vector<const SurfacePoint*>>> patches;
  for (auto piece = begin; piece != end; ++piece) {
    const Vec3 normal = piece->point->area_vector.normalized();
    const auto found = std::find_if(patches.begin(), patches.end(),
                                    [&](const auto& patch) { return patch.first.dot(normal) > kSamePatch; });
    if (found == patches.end())
      patches.push_back({normal, {piece->point}});
    else
      found->second.push_back(piece->point);
  }
  for (const auto& [normal, members] : patches) {
    ContactPoint made = patch_of(members, part, width);
    if (made.area > kLeastPatch * width * width) points.push_back(made);
  }
}

void add_faces(const Problem& problem, std::uint32_t part, const std::vector<SurfacePoint>& surface,
               int patches, std::vector<ContactPoint>& points) {
  std::vector<ContactPoint> faces;
  const Lattice& lattice = problem.body.parts[part].lattice;
  std::vector<Piece> pieces;
  pieces.reserve(surface.size());
  for (const SurfacePoint& point : surface) {
    if (!(point.area_vector.squaredNorm() > 0)) continue;
    const Vec3 at = lattice.to_lattice(point.position);
    Index3 share;
    for (int axis = 0; axis < 3; ++axis)
      share[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::floor(patches * at[axis]));
    pieces.push_back({&point, share});
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.key() < b.key(); });
  for (auto begin = pieces.cbegin(); begin != pieces.cend();) {
    const auto end =
        std::find_if(begin, pieces.cend(), [&](const Piece& piece) { return piece.key() != begin->key(); });
    gather(begin, end, part, lattice.spacing.mean(), faces);
    begin = end;
  }
  if (patches == 1) faces = merged_patches(lattice, std::move(faces));
  points.insert(points.end(), faces.begin(), faces.end());
}

double distance_to_polygon(const Surface& surface, const Triangles& triangles, std::uint32_t polygon,
                           const Vec3& from) {
  const auto [first, last] = std::equal_range(triangles.polygon.begin(), triangles.polygon.end(), polygon);
  double nearest = std::numeric_limits<double>::infinity();
  for (auto t = first; t != last; ++t) {
    const auto& corners = triangles.corners[static_cast<std::size_t>(t - triangles.polygon.begin())];
    nearest =
        std::min(nearest, distance_to_triangle(from, surface.vertices[corners[0]],
                                               surface.vertices[corners[1]], surface.vertices[corners[2]]));
  }
  return nearest;
}

// The polygons near a place, by cubes of kBallReach spacings.
class PolygonsByCube {
 public:
  PolygonsByCube(const std::vector<SurfacePoint>& surface, double width) : width_(kBallReach * width) {
    for (const SurfacePoint& point : surface)
      if (const Entry entry{cube(point.position), point.polygon};
          entries_.empty() || entries_.back() != entry)
        entries_.push_back(entry);
    std::sort(entries_.begin(), entries_.end());
    entries_.erase(std::unique(entries_.begin(), entries_.end()), entries_.end());
  }

  // Those with a point within kBallReach spacings of `at` are among them; ascending.
  [[nodiscard]] std::vector<std::uint32_t> near(const Vec3& at) const {
    std::vector<std::uint32_t> polygons;
    const Cube middle = cube(at);
    for (std::int64_t n = 0; n < 27; ++n) {
      const Cube wanted{middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1};
      for (auto entry = std::lower_bound(entries_.begin(), entries_.end(), Entry{wanted, 0});
           entry != entries_.end() && entry->first == wanted; ++entry)
        polygons.push_back(entry->second);
    }
    std::sort(polygons.begin(), polygons.end());
    polygons.erase(std::unique(polygons.begin(), polygons.end()), polygons.end());
    return polygons;
  }

 private:
  using Cube = std::array<std::int64_t, 3>;
  using Entry = std::pair<Cube, std::uint32_t>;
  [[nodiscard]] Cube cube(const Vec3& at) const {
    Cube found{};
    for (int axis = 0; axis < 3; ++axis)
      found[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::floor(at[axis] / width_));
    return found;
  }
  double width_ = 0;
  std::vector<Entry> entries_;
};

// Elements at centres that carry surface: a ball that reaches to the surface. Balls of two parts, or of a part
// and a plane, whose surfaces touch do not overlap then.
void add_balls(const Problem& problem, const Triangles& triangles, std::uint32_t part,
               const std::vector<SurfacePoint>& surface, std::vector<ContactPoint>& points) {
  const double width = problem.body.parts[part].lattice.spacing.mean();
  std::vector<std::uint32_t> outer;
  for (const SurfacePoint& point : surface) outer.push_back(point.at.elements[0]);
  std::sort(outer.begin(), outer.end());
  outer.erase(std::unique(outer.begin(), outer.end()), outer.end());
  const PolygonsByCube polygons(surface, width);
  const std::vector<double> factor = element_factors(problem.body, "radius_change");
  for (const std::uint32_t element : outer) {
    ContactPoint made;
    made.shape = ContactShape::ball;
    made.part = part;
    made.at = {{element}, {1}, 1};
    made.rest = problem.body.rest[element];
    made.area = width * width;
    made.radius = width;
    for (const std::uint32_t polygon : polygons.near(made.rest))
      made.radius =
          std::min(made.radius, distance_to_polygon(problem.body.surface, triangles, polygon, made.rest));
    if (!factor.empty()) made.radius *= factor[element];
    made.depth = made.radius;
    made.width = width;
    points.push_back(made);
  }
}

// Half the wall, where that is less than half a spacing: the distance to the surface that looks the other
// way.
void measure_walls(std::vector<ContactPoint>& points) {
  double reach = 0;
  std::vector<Vec3> at;
  for (const ContactPoint& point : points) {
    at.push_back(point.rest);
    reach = std::max(reach, 1.2 * point.width);
  }
  if (points.empty()) return;
  const Neighbours near = neighbours_within(at, reach, [&](std::uint32_t i, std::uint32_t j) {
    return points[i].part == points[j].part && points[i].normal.dot(points[j].normal) < -0.5;
  });
  const auto look = [&](ContactPoint& from, const ContactPoint& to) {
    const Vec3 way = to.rest - from.rest;
    const double wall = -way.dot(from.normal);
    if (wall > 0 && (way + wall * from.normal).norm() < 0.5 * from.width)
      from.depth = std::min(from.depth, 0.5 * wall);
  };
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t j : near.of(i)) {
      look(points[i], points[j]);
      look(points[j], points[i]);
    }
}

}  // namespace

std::vector<ContactPoint> contact_points(const Problem& problem, const std::vector<std::uint8_t>& parts,
                                         int patches) {
  const Body& body = problem.body;
  std::vector<std::vector<std::uint32_t>> polygons(body.parts.size());
  for (std::uint32_t p = 0; p < body.surface.polygon_count(); ++p)
    polygons[body.surface.polygon_part(p)].push_back(p);
  const Triangles triangles = triangulate(body.surface);
  std::vector<ContactPoint> points, balls;
  for (std::uint32_t part = 0; part < body.parts.size(); ++part) {
    if (!parts[part]) continue;
    const std::vector<SurfacePoint> surface = surface_points(problem, polygons[part]);
    if (body.parts[part].placement == Placement::corner)
      add_faces(problem, part, surface, patches, points);
    else
      add_balls(problem, triangles, part, surface, balls);
  }
  measure_walls(points);
  const std::vector<ContactPoint> edges = edge_points(problem, parts);
  points.insert(points.end(), edges.begin(), edges.end());
  points.insert(points.end(), balls.begin(), balls.end());
  std::stable_sort(points.begin(), points.end(),
                   [](const ContactPoint& a, const ContactPoint& b) { return a.part < b.part; });
  return points;
}

}  // namespace flexel::simulate
