#include "simulate/quadratic/face_points.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "formats/lattice/locate.h"
#include "simulate/matter/surface_points.h"

namespace flexel::simulate {
namespace {

constexpr double kFirm = 0.02;  // fill
constexpr int kStepsInwards = 2;
// Nodes in the middle of a cell's faces x-, x+, y-, y+, z-, z+.
constexpr std::array<std::size_t, 6> kFaceNodes = {12, 14, 10, 16, 4, 22};

// The cell beyond a face of a cell, if there is one.
std::optional<std::uint32_t> beyond(const QuadraticNodes& nodes, std::uint32_t cell, std::size_t face) {
  for (const QuadraticNodes::Incidence& at : nodes.at(nodes.of_cell[cell][kFaceNodes[face]]))
    if (at.cell != cell) return at.cell;
  return std::nullopt;
}

}  // namespace

std::vector<FacePoint> in_firm_cells(const Body& body, const QuadraticNodes& nodes,
                                     std::vector<FacePoint> points) {
  const std::vector<std::uint32_t> part = cell_parts(body);
  for (FacePoint& point : points) {
    const Part& own = body.parts[part[nodes.cells[point.cell]]];
    const Vec3 outward = own.lattice.axes.transpose() * point.area_vector;
    Eigen::Index axis = 0;
    outward.cwiseAbs().maxCoeff(&axis);
    const std::size_t face = 2 * static_cast<std::size_t>(axis) + (outward[axis] < 0 ? 1 : 0);
    for (int step = 0; step < kStepsInwards && body.fill[nodes.cells[point.cell]] < kFirm; ++step) {
      const std::optional<std::uint32_t> next = beyond(nodes, point.cell, face);
      if (!next || body.fill[nodes.cells[*next]] <= body.fill[nodes.cells[point.cell]]) break;
      point.cell = *next;
      point.at = cell_coordinates(body, own, nodes.cells[*next], point.position);
    }
  }
  return points;
}

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
