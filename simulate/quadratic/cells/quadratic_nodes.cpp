// An edge or a face is known by its elements: the keys of all cells are sorted, and equal ones are one node.
#include "simulate/quadratic/cells/quadratic_nodes.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "base/math/parallel_sort.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// The edge or face that node n of a cell lies on, by its elements in ascending order; edges have two of them.
using Key = std::array<std::uint32_t, 4>;

struct Place {
  Key key{kNone, kNone, kNone, kNone};
  std::uint32_t cell = 0, node = 0;  // index into `cells`
  friend bool operator<(const Place& a, const Place& b) {
    return a.key != b.key ? a.key < b.key : a.cell != b.cell ? a.cell < b.cell : a.node < b.node;
  }
};

// Corners of a cell around node n: one, two, four or eight.
std::vector<std::size_t> corners_around(std::size_t n) {
  std::vector<std::size_t> corners;
  for (std::size_t a = 0; a < 8; ++a)
    if (trilinear_weight(n, a) > 0) corners.push_back(a);
  return corners;
}

void number_elements(const Body& body, QuadraticNodes& nodes) {
  std::vector<std::uint32_t> node(body.element_count(), kNone);
  for (const std::uint32_t c : nodes.cells)
    for (const std::uint32_t e : body.cell_elements[c]) node[e] = 0;
  for (std::uint32_t e = 0; e < node.size(); ++e)
    if (node[e] == 0) {
      node[e] = static_cast<std::uint32_t>(nodes.elements.size());
      nodes.elements.push_back(e);
      nodes.rest.push_back(body.rest[e]);
    }
  for (std::size_t i = 0; i < nodes.cells.size(); ++i)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      if (const std::size_t corner = corner_of_node(n); corner < 8)
        nodes.of_cell[i][n] = node[body.cell_elements[nodes.cells[i]][corner]];
}

// Nodes on edges and faces, then in the middle of cells.
void number_between(const Body& body, QuadraticNodes& nodes) {
  std::array<std::vector<std::size_t>, kQuadraticNodes> around;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) around[n] = corners_around(n);
  std::vector<Place> places;
  places.reserve(18 * nodes.cells.size());
  for (std::uint32_t i = 0; i < nodes.cells.size(); ++i)
    for (std::uint32_t n = 0; n < kQuadraticNodes; ++n) {
      if (around[n].size() != 2 && around[n].size() != 4) continue;
      Place place{.cell = i, .node = n};
      for (std::size_t a = 0; a < around[n].size(); ++a)
        place.key[a] = body.cell_elements[nodes.cells[i]][around[n][a]];
      std::sort(place.key.begin(), place.key.end());
      places.push_back(place);
    }
  parallel_sort(places.begin(), places.end(), std::less<>());
  const auto middle = [&](std::uint32_t cell, std::uint32_t node) {
    Vec3 sum = Vec3::Zero();
    for (const std::size_t a : around[node]) sum += body.rest[body.cell_elements[nodes.cells[cell]][a]];
    return Vec3(sum / static_cast<double>(around[node].size()));
  };
  for (std::size_t p = 0; p < places.size(); ++p) {
    if (p == 0 || places[p].key != places[p - 1].key)
      nodes.rest.push_back(middle(places[p].cell, places[p].node));
    nodes.of_cell[places[p].cell][places[p].node] = static_cast<std::uint32_t>(nodes.rest.size() - 1);
  }
  constexpr std::uint32_t kCentre = 13;
  for (std::uint32_t i = 0; i < nodes.cells.size(); ++i) {
    nodes.of_cell[i][kCentre] = static_cast<std::uint32_t>(nodes.rest.size());
    nodes.rest.push_back(middle(i, kCentre));
  }
}

}  // namespace

QuadraticNodes quadratic_nodes(const Body& body, const std::vector<std::uint8_t>& active) {
  QuadraticNodes nodes;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (active[c]) nodes.cells.push_back(c);
  nodes.of_cell.resize(nodes.cells.size());
  number_elements(body, nodes);
  number_between(body, nodes);
  nodes.offsets.assign(nodes.size() + 1, 0);
  for (const auto& cell : nodes.of_cell)
    for (const std::uint32_t node : cell) ++nodes.offsets[node + 1];
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes.offsets[n + 1] += nodes.offsets[n];
  nodes.incidences.resize(nodes.offsets.back());
  std::vector<std::uint32_t> next(nodes.offsets.begin(), nodes.offsets.end() - 1);
  for (std::uint32_t i = 0; i < nodes.of_cell.size(); ++i)
    for (std::uint32_t n = 0; n < kQuadraticNodes; ++n)
      nodes.incidences[next[nodes.of_cell[i][n]]++] = {i, n};
  return nodes;
}

std::array<Vec3, kQuadraticNodes> local_displacement(const QuadraticNodes& nodes, std::size_t cell,
                                                     const std::vector<Vec3>& displacement,
                                                     const Mat3& turn) {
  const auto& of_cell = nodes.of_cell[cell];
  std::array<Vec3, kQuadraticNodes> local;
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    const Vec3 rest = nodes.rest[of_cell[n]] - nodes.rest[of_cell[0]];
    const Vec3 moved = displacement[of_cell[n]] - displacement[of_cell[0]];
    local[n] = moved + turn.transpose() * (rest + moved);
  }
  return local;
}

}  // namespace flexel::simulate
