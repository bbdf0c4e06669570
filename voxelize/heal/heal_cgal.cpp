// CGAL's hole filling and alpha wrapping.
#include "voxelize/heal/heal_cgal.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <algorithm>

#include "base/program/share_scope.h"
#include "base/stop.h"

namespace flexel::voxelize {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;

std::vector<Point> points_of(const std::vector<Vec3>& vertices) {
  std::vector<Point> points;
  points.reserve(vertices.size());
  for (const Vec3& v : vertices) points.emplace_back(v.x(), v.y(), v.z());
  return points;
}

}  // namespace

std::vector<Corners> close_loop(const std::vector<Vec3>& loop, const std::vector<Vec3>& across) {
  std::vector<CGAL::Triple<int, int, int>> found;
  CGAL::Polygon_mesh_processing::triangulate_hole_polyline(points_of(loop), points_of(across),
                                                           std::back_inserter(found));
  std::vector<Corners> triangles;
  for (const auto& t : found)
    triangles.push_back({static_cast<std::uint32_t>(t.first), static_cast<std::uint32_t>(t.second),
                         static_cast<std::uint32_t>(t.third)});
  return triangles;
}

namespace {

// `vertices`: about as many as the wrap's tetrahedra will have.
struct HearsStops : CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
  explicit HearsStops(double vertices) : vertices_(vertices) {}
  template <typename AlphaWrapper, typename Gate>
  void before_facet_treatment(const AlphaWrapper& wrapper, const Gate&) {
    check_stop();
    constexpr std::size_t kGatesAtATime = 256;
    if (++gates_ % kGatesAtATime == 0)
      tell_share(static_cast<double>(wrapper.triangulation().number_of_vertices()) / vertices_);
  }

 private:
  double vertices_;
  std::size_t gates_ = 0;
};

}  // namespace

PartMesh alpha_wrap(const PartMesh& mesh, double alpha, double offset) {
  const std::vector<Point> points = points_of(mesh.world);
  // CGAL leaves out triangles whose corners lie on a line, and crashes where none is left.
  if (std::all_of(mesh.corners.begin(), mesh.corners.end(), [&](const Corners& c) {
        return CGAL::collinear(points[c[0]], points[c[1]], points[c[2]]);
      }))
    return {};
  CGAL::Surface_mesh<Point> wrap;
  constexpr double kVerticesPerSquare = 1.25;  // of alpha's width on the surface; 1.14 to 1.4 of five parts
  HearsStops visitor(kVerticesPerSquare * surface_area(mesh) / (alpha * alpha));
  CGAL::alpha_wrap_3(points, mesh.corners, alpha, offset, wrap, CGAL::parameters::default_values(),
                     CGAL::parameters::visitor(visitor));
  PartMesh result;
  for (const auto v : wrap.vertices()) {
    const Point& p = wrap.point(v);
    result.world.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : wrap.faces()) {
    Corners c{};
    int n = 0;
    for (const auto v : CGAL::vertices_around_face(wrap.halfedge(f), wrap))
      c[static_cast<std::size_t>(n++)] = static_cast<std::uint32_t>(v.idx());
    result.corners.push_back(c);
    result.polygon.push_back(kNoPolygon);
  }
  number_edges(result);
  return result;
}

struct RayCaster::Tree {
  using Triangle = Kernel::Triangle_3;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Triangle>::const_iterator>;
  std::vector<Triangle> triangles;     // without those whose corners lie on a line: no ray may ask them
  std::vector<std::uint32_t> numbers;  // theirs in the mesh
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;
};

RayCaster::RayCaster(const PartMesh& mesh) : tree_(std::make_unique<Tree>()) {
  const std::vector<Point> points = points_of(mesh.world);
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    const Corners& c = mesh.corners[t];
    const Tree::Triangle triangle(points[c[0]], points[c[1]], points[c[2]]);
    if (triangle.is_degenerate()) continue;
    tree_->triangles.push_back(triangle);
    tree_->numbers.push_back(t);
  }
  tree_->tree.rebuild(tree_->triangles.cbegin(), tree_->triangles.cend());
}
RayCaster::~RayCaster() = default;

std::optional<RayCaster::Hit> RayCaster::first(const Vec3& from, const Vec3& unit_direction,
                                               std::uint32_t own) const {
  const Point origin(from.x(), from.y(), from.z());
  const Kernel::Ray_3 ray(origin,
                          Kernel::Vector_3(unit_direction.x(), unit_direction.y(), unit_direction.z()));
  const auto number = [&](const auto& id) {
    return tree_->numbers[static_cast<std::size_t>(id - tree_->triangles.cbegin())];
  };
  const auto met = tree_->tree.first_intersection(ray, [&](const auto& id) { return number(id) == own; });
  if (!met || number(met->second) == own) return std::nullopt;  // a tree of one triangle skips none
  const Point* point = boost::get<Point>(&met->first);
  if (point == nullptr) return std::nullopt;  // along the triangle
  return Hit{std::sqrt(CGAL::squared_distance(origin, *point)), number(met->second)};
}

}  // namespace flexel::voxelize
