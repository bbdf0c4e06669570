// Self-intersection: boxes that meet (CGAL's box intersection), then the triangles with exact predicates;
// only pairs that did not meet at rest are counted, those of two parts by how deep they are in each other. Voronoi: the Delaunay triangulation's edges are the
// candidates; the facet of an edge is the polygon of the circumcentres of the cells around it.
#include "mapping/checks/cgal_checks.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/error.h"
#include "base/program/share_scope.h"
#include "formats/part/topology.h"

namespace flexel::mapping {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Corners = std::array<std::uint32_t, 3>;
using InPlane = Eigen::Vector2d;

Point point(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

Kernel::Triangle_3 triangle(const std::vector<Vec3>& at, const Corners& t) {
  return {point(at[t[0]]), point(at[t[1]]), point(at[t[2]])};
}

bool meet(const std::vector<Vec3>& at, const Corners& a, const Corners& b) {
  const Kernel::Triangle_3 first = triangle(at, a), second = triangle(at, b);
  return !first.is_degenerate() && !second.is_degenerate() && CGAL::do_intersect(first, second);
}

bool share_a_corner(const Corners& a, const Corners& b) {
  return std::any_of(a.begin(), a.end(),
                     [&](std::uint32_t v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

// m, of two triangles that meet: the least way that parts them, along a normal or square to an edge of each.
double depth(const std::vector<Vec3>& at, const Corners& a, const Corners& b) {
  const auto edge = [&](const Corners& of, std::size_t n) { return Vec3(at[of[(n + 1) % 3]] - at[of[n]]); };
  double least = std::numeric_limits<double>::infinity();
  const auto try_axis = [&](const Vec3& axis, double scale) {
    if (!(axis.norm() > 1e-6 * scale)) return;
    const Vec3 along = axis.normalized();
    const auto extent = [&](const Corners& of) {
      const std::array<double, 3> x{along.dot(at[of[0]]), along.dot(at[of[1]]), along.dot(at[of[2]])};
      const auto [low, high] = std::minmax_element(x.begin(), x.end());
      return std::array{*low, *high};
    };
    const auto first = extent(a), second = extent(b);
    least = std::min({least, first[1] - second[0], second[1] - first[0]});
  };
  for (const Corners* of : {&a, &b})
    try_axis(edge(*of, 0).cross(edge(*of, 1)), edge(*of, 0).norm() * edge(*of, 1).norm());
  for (std::size_t m = 0; m < 3; ++m)
    for (std::size_t n = 0; n < 3; ++n)
      try_axis(edge(a, m).cross(edge(b, n)), edge(a, m).norm() * edge(b, n).norm());
  return std::max(least, 0.0);
}

struct Solid {
  std::vector<Kernel::Triangle_3> triangles;  // none degenerate
  bool open = false;                          // has open edges, and so no sure inside
};
using Solids = std::vector<Solid>;  // (parts)
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<
    Kernel, CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>>>;

// m, of corners of one part inside another, from its surface, at most: where a ray meets that an odd number of times.
// None is inside an open surface.
double deepest_corner(const Solid& of, const Solid& in) {
  if (in.open) return 0;
  const Kernel::Vector_3 somewhere(0.80171, 0.33419, 0.49573);
  const Tree tree(in.triangles.begin(), in.triangles.end());
  double deepest = 0;
  for (const Kernel::Triangle_3& each : of.triangles)
    for (int n = 0; n < 3; ++n) {
      const Point corner = each.vertex(n);
      if (!CGAL::do_overlap(corner.bbox(), tree.bbox())) continue;
      if (tree.number_of_intersected_primitives(Kernel::Ray_3(corner, somewhere)) % 2 == 1)
        deepest = std::max(deepest, std::sqrt(tree.squared_distance(corner)));
    }
  return deepest;
}

constexpr double kThrough = 0.25;  // spacings, beyond which parts have passed through each other

// Of meetings of two parts by their pairs of triangles, how deep each is: large triangles that cross tell it
// themselves, of small ones the corners that are inside.
void add_depths(const std::map<std::array<std::uint32_t, 2>, std::vector<double>>& meetings,
                const Solids& solids, const Body& body, SurfaceMeetings& found) {
  for (const auto& [parts, depths] : meetings) {
    const auto [one, other] = parts;
    const double inside =
        std::max(deepest_corner(solids[one], solids[other]), deepest_corner(solids[other], solids[one]));
    const double limit = kThrough * std::min(body.parts[one].lattice.spacing.minCoeff(),
                                             body.parts[other].lattice.spacing.minCoeff());
    found.between += depths.size();
    found.through += static_cast<std::size_t>(std::count_if(
        depths.begin(), depths.end(), [&](double each) { return std::max(each, inside) > limit; }));
    found.deepest = std::max({found.deepest, inside, *std::max_element(depths.begin(), depths.end())});
  }
}

using Vertex = CGAL::Triangulation_vertex_base_with_info_3<std::uint32_t, Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<Vertex, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>>;

constexpr double kSmallFacet = 0.05;  // of the spacing squared
constexpr double kReach = 1.5;        // spacings

// The four corners of a square of the lattice can make a cell without volume, whose circumcentre is rounding;
// it lies between those of the cells beside it.
bool is_sliver(const Delaunay& delaunay, const Delaunay::Cell_handle& cell, double reach) {
  constexpr double kSliver = 1e-6;  // of the cubed spacing, nearly
  return std::abs(delaunay.tetrahedron(cell).volume()) < kSliver * reach * reach * reach;
}

// Signed area, in m^2, of what the triangle (0, a, b) has in common with the disc of that radius about 0.
double area_in_disc(const InPlane& a, const InPlane& b, double radius) {
  const auto cross = [](const InPlane& p, const InPlane& q) { return p.x() * q.y() - p.y() * q.x(); };
  const auto sector = [&](const InPlane& p, const InPlane& q) {
    return radius * radius * std::atan2(cross(p, q), p.dot(q)) / 2;
  };
  const InPlane way = b - a;
  const double half = a.dot(way), length = way.squaredNorm();
  const double root = half * half - length * (a.squaredNorm() - radius * radius);
  if (!(root > 0)) return sector(a, b);
  const double enters = (-half - std::sqrt(root)) / length, leaves = (-half + std::sqrt(root)) / length;
  if (leaves <= 0 || enters >= 1) return sector(a, b);
  const InPlane in = a + std::max(enters, 0.0) * way, out = a + std::min(leaves, 1.0) * way;
  return (enters > 0 ? sector(a, in) : 0) + cross(in, out) / 2 + (leaves < 1 ? sector(out, b) : 0);
}

// Area of the Voronoi facet between the ends of `edge` within `reach` of their `middle`, in m^2.
double facet_area(const Delaunay& delaunay, const Delaunay::Edge& edge, const Vec3& middle, double reach) {
  const Point one = edge.first->vertex(edge.second)->point(), other = edge.first->vertex(edge.third)->point();
  const Vec3 along = Vec3(other.x() - one.x(), other.y() - one.y(), other.z() - one.z()).normalized();
  const Vec3 first_axis = along.unitOrthogonal(), second_axis = along.cross(first_axis);
  std::vector<InPlane> polygon;
  auto cell = delaunay.incident_cells(edge);
  const auto first = cell;
  do {
    if (delaunay.is_infinite(cell) || is_sliver(delaunay, cell, reach)) continue;
    const Point centre = delaunay.dual(cell);
    const Vec3 away = Vec3(centre.x(), centre.y(), centre.z()) - middle;
    if (away.allFinite()) polygon.emplace_back(away.dot(first_axis), away.dot(second_axis));
  } while (++cell != first);
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    area += area_in_disc(polygon[i], polygon[(i + 1) % polygon.size()], reach);
  return std::abs(area);
}

constexpr std::uint32_t kGuard = 0xFFFFFFFF;  // no element

// Points far around the others. Without them the cells at the rim of a part are bounded by its hull, and which
// of its nearly coplanar points are corners of that is rounding.
void add_guards(std::vector<std::pair<Point, std::uint32_t>>& points) {
  constexpr double kFar = 10;  // diagonals
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& [at, element] : points) {
    low = low.cwiseMin(Vec3(at.x(), at.y(), at.z()));
    high = high.cwiseMax(Vec3(at.x(), at.y(), at.z()));
  }
  const double far = kFar * (high - low).norm();
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 way((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
    points.emplace_back(point((low + high) / 2 + far * way), kGuard);
  }
}

// (elements of the part) the elements, ascending, that each has a large facet with; nothing for elements that
// hold no vertex.
std::vector<std::vector<std::uint32_t>> large_neighbours(const Part& part, const std::vector<Vec3>& position,
                                                         const std::vector<std::uint8_t>& holds) {
  std::vector<std::pair<Point, std::uint32_t>> points;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    points.emplace_back(point(position[e]), e);
  if (points.empty()) return {};
  add_guards(points);
  const Delaunay delaunay(points.begin(), points.end());
  std::vector<std::vector<std::uint32_t>> neighbours(part.element_end - part.element_begin);
  if (delaunay.dimension() < 3) return neighbours;
  const double spacing = part.lattice.spacing.minCoeff();
  for (auto edge = delaunay.finite_edges_begin(); edge != delaunay.finite_edges_end(); ++edge) {
    const std::uint32_t a = edge->first->vertex(edge->second)->info(),
                        b = edge->first->vertex(edge->third)->info();
    if (a == kGuard || b == kGuard || (!holds[a] && !holds[b])) continue;
    const Vec3 middle = (position[a] + position[b]) / 2;
    if (facet_area(delaunay, *edge, middle, kReach * spacing) < kSmallFacet * spacing * spacing) continue;
    if (holds[a]) neighbours[a - part.element_begin].push_back(b);
    if (holds[b]) neighbours[b - part.element_begin].push_back(a);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  return neighbours;
}

}  // namespace

SurfaceMeetings new_meetings(const Body& body, const std::vector<Vec3>& displacement) {
  using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;
  const Surface& surface = body.surface;
  Triangles triangles = triangulate(surface);
  const std::vector<std::uint32_t> welded = weld(surface.vertices);
  std::vector<Vec3> moved = surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += displacement[v];
  std::vector<TriangleBox> boxes;
  for (std::uint32_t t = 0; t < triangles.corners.size(); ++t) {
    for (std::uint32_t& v : triangles.corners[t]) v = welded[v];
    boxes.emplace_back(triangle(moved, triangles.corners[t]).bbox(), t);
  }
  const auto part_of = [&](std::uint32_t t) { return surface.polygon_part(triangles.polygon[t]); };
  std::map<std::array<std::uint32_t, 2>, std::vector<double>> meetings;
  SurfaceMeetings found;
  constexpr std::size_t kPairsPerTriangle = 7;  // that touch at a corner, or nearly
  ShareCounter done(kPairsPerTriangle * boxes.size());
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const TriangleBox& a, const TriangleBox& b) {
    done.add(1);
    const Corners &first = triangles.corners[a.info()], &second = triangles.corners[b.info()];
    if (share_a_corner(first, second) || !meet(moved, first, second) || meet(surface.vertices, first, second))
      return;
    const std::uint32_t one = part_of(a.info()), other = part_of(b.info());
    if (one == other)
      ++found.self;
    else
      meetings[{std::min(one, other), std::max(one, other)}].push_back(depth(moved, first, second));
  });
  if (meetings.empty()) return found;
  Solids solids(body.parts.size());
  std::vector<std::vector<Corners>> corners(body.parts.size());
  for (std::uint32_t t = 0; t < triangles.corners.size(); ++t) {
    corners[part_of(t)].push_back(triangles.corners[t]);
    if (const Kernel::Triangle_3 each = triangle(moved, triangles.corners[t]); !each.is_degenerate())
      solids[part_of(t)].triangles.push_back(each);
  }
  for (std::size_t p = 0; p < solids.size(); ++p)
    solids[p].open = topology(corners[p], welded).open_edges > 0;
  add_depths(meetings, solids, body, found);
  return found;
}

std::vector<std::uint8_t> voronoi_changes(const Body& body, const MapResult& result) {
  std::vector<std::uint8_t> holds(body.element_count(), 0), changed(body.element_count(), 0);
  for (std::size_t v = 0; v < result.frame.size(); ++v)
    if (result.referenced[v]) holds[result.frame_of(v).elements[0]] = 1;
  for (const Vec3& x : body.position)
    if (!x.allFinite()) throw InputError("--check voronoi needs a body whose elements have finite positions");
  for (const Part& part : body.parts) {
    const auto before = large_neighbours(part, body.rest, holds);
    const auto after = large_neighbours(part, body.position, holds);
    for (std::size_t i = 0; i < before.size(); ++i) changed[part.element_begin + i] = before[i] != after[i];
  }
  return changed;
}

}  // namespace flexel::mapping
