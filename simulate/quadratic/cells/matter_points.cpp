// Integrals of element shape functions over the matter, node by node.
#include "simulate/quadratic/cells/matter_points.h"

#include <limits>
#include <map>

namespace flexel::simulate {
namespace {

// Of a cell's nodes and of its elements, at the points whose weights the moments are: the same in every cell.
struct ShapesAtPoints {
  std::array<std::array<double, kQuadraticNodes>, kMoments> node{};
  std::array<std::array<double, 8>, kMoments> element{};
};

ShapesAtPoints shapes_at_points() {
  ShapesAtPoints made;
  for (std::size_t k = 0; k < kMoments; ++k) {
    made.node[k] = quadratic_shape(gauss_point(k)).value;
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        made.element[k][a] += trilinear_weight(n, a) * made.node[k][n];
  }
  return made;
}

// m^3: integrals of the shape functions of a cell's nodes times that of its element `corner`, over its matter.
std::array<double, kQuadraticNodes> weighted_integrals(std::size_t corner, double voxel,
                                                       const Moments& moments) {
  static const ShapesAtPoints shapes = shapes_at_points();
  std::array<double, kQuadraticNodes> sum{};
  for (std::size_t k = 0; k < kMoments; ++k) {
    const double weight = shapes.element[k][corner] * voxel * moments[static_cast<Eigen::Index>(k)];
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) sum[n] += weight * shapes.node[k][n];
  }
  return sum;
}

}  // namespace

std::vector<MatterPoint> matter_points(const Body& body, const QuadraticNodes& nodes,
                                       const std::vector<std::uint32_t>& elements,
                                       const std::function<Moments(std::size_t)>& moments,
                                       const std::function<const Lattice&(std::size_t)>& lattice) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> place(body.element_count(), kNone);
  for (std::size_t i = 0; i < elements.size(); ++i) place[elements[i]] = i;
  std::vector<std::map<std::uint32_t, double>> carried(elements.size());
  for (std::size_t c = 0; c < nodes.cells.size(); ++c)
    for (std::size_t a = 0; a < 8; ++a) {
      const std::size_t at = place[body.cell_elements[nodes.cells[c]][a]];
      if (at == kNone) continue;
      const auto volumes = weighted_integrals(a, lattice(c).spacing.prod(), moments(c));
      for (std::size_t n = 0; n < kQuadraticNodes; ++n) carried[at][nodes.of_cell[c][n]] += volumes[n];
    }
  std::vector<MatterPoint> made;
  for (const std::map<std::uint32_t, double>& each : carried) {
    MatterPoint point;
    for (const auto& [node, volume] : each) point.point.weight += volume;
    if (!(point.point.weight > 0)) continue;
    for (const auto& [node, volume] : each) {
      point.carriers.emplace_back(node, volume / point.point.weight);
      point.point.position += volume / point.point.weight * nodes.rest[node];
    }
    made.push_back(std::move(point));
  }
  return made;
}

}  // namespace flexel::simulate
