// The unknowns of model `quadratic`: 27 nodes a cell. Cells share the nodes of an edge or a face where they share
// all of its elements, so two pieces of matter that the lattice keeps apart have nodes of their own.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/lattice/quadratic_field.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

struct QuadraticNodes {
  std::vector<std::uint32_t> cells;  // of the body, those that resist, ascending
  std::vector<std::array<std::uint32_t, kQuadraticNodes>> of_cell;  // (cells)
  // Nodes: first those that are elements, ascending, then those of edges and faces, then of cells
  std::vector<std::uint32_t> elements;  // (element nodes)
  std::vector<Vec3> rest;               // (nodes x 3) m, world frame
  // (nodes + 1) and (27 x cells): which cells meet at a node, ascending
  struct Incidence {
    std::uint32_t cell = 0, node = 0;  // index into `cells`, node of the cell
  };
  std::vector<std::uint32_t> offsets;
  std::vector<Incidence> incidences;

  [[nodiscard]] std::size_t size() const { return rest.size(); }
  [[nodiscard]] std::span<const Incidence> at(std::size_t node) const {
    return {incidences.data() + offsets[node], offsets[node + 1] - offsets[node]};
  }
};

// `active`: (cells of the body) 1 where a cell resists.
[[nodiscard]] QuadraticNodes quadratic_nodes(const Body& body, const std::vector<std::uint8_t>& active);

// (27 x 3) m: the displacement of a cell's nodes beside its first one, once the cell's rotation R is taken out of it;
// `turn` is R - 1.
[[nodiscard]] std::array<Vec3, kQuadraticNodes> local_displacement(const QuadraticNodes& nodes,
                                                                   std::size_t cell,
                                                                   const std::vector<Vec3>& displacement,
                                                                   const Mat3& turn);

}  // namespace flexel::simulate
