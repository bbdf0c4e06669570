// Constrained Delaunay triangulation; then the faces are walked from the outside, and every edge that is a
// constraint changes between outside and inside.
#include "mapping/crack/crack_triangulate.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

namespace flexel::mapping {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<
    Kernel, CGAL::Triangulation_face_base_with_info_2<signed char, Kernel>>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel,
                                               CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;

// Sets the info of every face: 1 inside, 0 outside.
void mark(Triangulation& triangulation) {
  for (auto face : triangulation.all_face_handles()) face->info() = -1;
  std::vector<Triangulation::Face_handle> left{triangulation.infinite_face()};
  left.back()->info() = 0;
  while (!left.empty()) {
    const Triangulation::Face_handle face = left.back();
    left.pop_back();
    for (int side = 0; side < 3; ++side) {
      const Triangulation::Face_handle next = face->neighbor(side);
      if (next->info() >= 0) continue;
      next->info() = static_cast<signed char>(face->is_constrained(side) ? 1 - face->info() : face->info());
      left.push_back(next);
    }
  }
}

}  // namespace

std::optional<std::vector<std::array<std::uint32_t, 3>>> triangulate_inside(
    const std::vector<Eigen::Vector2d>& points, const std::vector<std::array<std::uint32_t, 2>>& edges) {
  Triangulation triangulation;
  std::vector<Triangulation::Vertex_handle> vertex;
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    const std::size_t before = triangulation.number_of_vertices();
    vertex.push_back(triangulation.insert(Kernel::Point_2(points[p].x(), points[p].y())));
    if (triangulation.number_of_vertices() == before) return std::nullopt;
    vertex.back()->info() = p;
  }
  try {
    for (const auto& [a, b] : edges) triangulation.insert_constraint(vertex[a], vertex[b]);
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    return std::nullopt;
  }
  // Where an edge ran over a point it is two edges now.
  for (const auto& [a, b] : edges) {
    Triangulation::Face_handle face;
    int side = 0;
    if (!triangulation.is_edge(vertex[a], vertex[b], face, side) || !face->is_constrained(side))
      return std::nullopt;
  }
  if (triangulation.dimension() < 2) return std::vector<std::array<std::uint32_t, 3>>{};
  mark(triangulation);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (auto face : triangulation.finite_face_handles())
    if (face->info() == 1)
      triangles.push_back({face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()});
  return triangles;
}

}  // namespace flexel::mapping
