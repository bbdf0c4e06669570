#include "cgal_solid.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <iomanip>
#include <sstream>

namespace flexel::mapping::test {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

std::string what_cgal_minds(const std::vector<Vec3>& points,
                            const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  std::vector<Point> soup;
  std::vector<std::vector<std::size_t>> polygons;
  for (const auto& triangle : triangles) {
    polygons.emplace_back();
    for (const std::uint32_t v : triangle) {
      polygons.back().push_back(soup.size());
      soup.emplace_back(points[v].x(), points[v].y(), points[v].z());
    }
  }
  PMP::merge_duplicate_points_in_polygon_soup(soup, polygons);
  if (!PMP::is_polygon_soup_a_polygon_mesh(polygons)) return "no oriented manifold";
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(soup, polygons, mesh);
  if (!CGAL::is_closed(mesh)) return "open";
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> crossing;
  PMP::self_intersections(mesh, std::back_inserter(crossing));
  if (!crossing.empty()) {
    std::ostringstream text;
    text << "crosses itself: " << std::setprecision(12);
    for (const Mesh::Face_index face : {crossing.front().first, crossing.front().second})
      for (const Mesh::Vertex_index vertex : mesh.vertices_around_face(mesh.halfedge(face)))
        text << "(" << mesh.point(vertex) << ") ";
    return text.str();
  }
  if (!PMP::does_bound_a_volume(mesh)) return "bounds no volume";
  return "";
}

}  // namespace flexel::mapping::test
