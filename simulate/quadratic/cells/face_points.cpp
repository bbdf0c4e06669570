// Polygons are cut by planes of the lattice axis by axis; the piece in a voxel gets Gauss points of the triangles of
// its fan, collapsed from a square.
#include "simulate/quadratic/cells/face_points.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "formats/lattice/locate.h"

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

// Gauss's points on [0, 1]: four, exact to degree 7; two for pieces that are small beside a voxel.
struct Rule {
  std::vector<double> at, weight;
};
const Rule& rule_of(bool small) {
  static const Rule two{{0.21132486540518712, 0.78867513459481288}, {0.5, 0.5}};
  static const Rule four{
      {0.06943184420297371, 0.33000947820757187, 0.66999052179242813, 0.93056815579702629},
      {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693}};
  return small ? two : four;
}

void add_points(const Body& body, const Part& part, std::uint32_t cell, std::uint32_t body_cell,
                const Outline& piece, std::vector<FacePoint>& points) {
  Outline polygon;
  for (const Vec3& corner : piece) polygon.push_back(part.lattice.to_world(corner));
  for_each_gauss_point(polygon, is_small(piece), [&](const Vec3& position, const Vec3& area_vector) {
    points.push_back({cell, cell_coordinates(body, part, body_cell, position), position, area_vector});
  });
}

}  // namespace

bool is_small(const Outline& piece) {
  constexpr double kSmall = 0.1;  // spacings
  double largest = 0;
  for (const Vec3& corner : piece) largest = std::max(largest, (corner - piece[0]).cwiseAbs().maxCoeff());
  return largest < kSmall;
}

// Of each triangle of its fan those of a square, collapsed to it.
void for_each_gauss_point(const Outline& polygon, bool small,
                          const std::function<void(const Vec3&, const Vec3&)>& use) {
  const Rule& rule = rule_of(small);
  for (std::size_t v = 1; v + 1 < polygon.size(); ++v) {
    const Vec3 &a = polygon[0], &b = polygon[v], &c = polygon[v + 1];
    const Vec3 area = 0.5 * (b - a).cross(c - a);
    if (!(area.norm() > 0)) continue;
    for (std::size_t r = 0; r < rule.at.size(); ++r)
      for (std::size_t q = 0; q < rule.at.size(); ++q)
        use(a + rule.at[r] * ((b - a) + rule.at[q] * (c - b)),
            2 * rule.weight[r] * rule.at[r] * rule.weight[q] * area);
  }
}

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
                                   const std::vector<std::uint32_t>& polygons, const VoxelRange* range) {
  const Body& body = problem.body;
  const Triangles triangles = triangulate(body.surface);
  std::vector<std::uint8_t> chosen(body.surface.polygon_count(), 0);
  for (const std::uint32_t p : polygons) chosen[p] = 1;
  std::vector<FacePoint> points;
  std::optional<SurfaceLocator> locate;
  std::uint32_t polygon = 0;
  for (std::size_t t = 0; t < triangles.polygon.size(); ++t) {
    if (!chosen[triangles.polygon[t]]) continue;
    if (!locate || triangles.polygon[t] != polygon) {
      polygon = triangles.polygon[t];
      locate.emplace(body, polygon);
    }
    const Part& part = body.parts[body.surface.polygon_part(polygon)];
    Outline corners;
    for (const std::uint32_t v : triangles.corners[t])
      corners.push_back(part.lattice.to_lattice(body.surface.vertices[v]));
    if (range != nullptr) corners = in_range(corners, *range);
    if (corners.size() < 3) continue;
    for_each_voxel(corners, 0, [&](const Outline& piece) {
      const std::optional<CellPoint> found = (*locate)(part.lattice.to_world(middle_of(piece)));
      if (!found) return;
      const auto cell = std::lower_bound(nodes.cells.begin(), nodes.cells.end(), found->cell);
      if (cell == nodes.cells.end() || *cell != found->cell) return;  // it resists nothing
      add_points(body, part, static_cast<std::uint32_t>(cell - nodes.cells.begin()), *cell, piece, points);
    });
  }
  return points;
}

QuadraticShape world_shape(const Lattice& lattice, const Vec3& at) {
  QuadraticShape shape = quadratic_shape(at);
  for (Vec3& gradient : shape.gradient) gradient = lattice.axes * gradient.cwiseQuotient(lattice.spacing);
  return shape;
}

}  // namespace flexel::simulate
