#include "simulate/quadratic/face_points.h"

#include <algorithm>
#include <memory>

#include "formats/lattice/locate.h"
#include "simulate/matter/surface_points.h"

namespace flexel::simulate {

std::vector<FacePoint> face_points(const Problem& problem, const QuadraticNodes& nodes,
                                   const std::vector<std::uint32_t>& polygons) {
  const Body& body = problem.body;
  std::vector<FacePoint> points;
  std::unique_ptr<SurfaceLocator> locate;
  std::uint32_t polygon = 0;
  for (const SurfacePoint& point : surface_points(problem, polygons)) {
    if (!locate || point.polygon != polygon) {
      polygon = point.polygon;
      locate = std::make_unique<SurfaceLocator>(body, polygon);
    }
    const std::optional<CellPoint> found = (*locate)(point.position);
    if (!found) continue;
    const auto cell = std::lower_bound(nodes.cells.begin(), nodes.cells.end(), found->cell);
    if (cell == nodes.cells.end() || *cell != found->cell) continue;  // it resists nothing
    const Part& part = body.parts[body.surface.polygon_part(polygon)];
    points.push_back({static_cast<std::uint32_t>(cell - nodes.cells.begin()),
                      cell_coordinates(body, part, found->cell, point.position), point.position,
                      point.area_vector});
  }
  return points;
}

QuadraticShape world_shape(const Lattice& lattice, const Vec3& at) {
  QuadraticShape shape = quadratic_shape(at);
  for (Vec3& gradient : shape.gradient) gradient = lattice.axes * gradient.cwiseQuotient(lattice.spacing);
  return shape;
}

}  // namespace flexel::simulate
