// The tangent stiffness over the elements and where each cell's blocks go in it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/linear/block_matrix.h"
#include "simulate/models/connections.h"

namespace flexel::simulate {

// Elements between which an effect acts, each with each; ascending.
using CoupledElements = std::vector<std::uint32_t>;

// One cell at one of its elements.
struct Incidence {
  std::uint32_t cell = 0;
  std::uint32_t corner = 0;
};

// Which cells meet at an element (compressed rows, ascending by cell), and the place of each cell's 8 x 8
// blocks in its rows.
struct Stencil {
  std::vector<std::uint32_t> offsets;  // (elements + 1)
  std::vector<Incidence> incidences;   // (8 cells)
  std::vector<std::array<std::uint16_t, 64>>
      slot;  // (cells) block (a, b) of a cell is entry slot[8 a + b] of the row of its element a
  [[nodiscard]] std::span<const Incidence> of(std::uint32_t element) const {
    return {incidences.data() + offsets[element], offsets[element + 1] - offsets[element]};
  }
};

// The stencil of the cells with active[cell] != 0, and a matrix of zeros with its pattern: a row per element,
// its diagonal always present. Connected elements, and those of a group of `coupled`, are neighbours as those
// of one cell are. The matrix has values only where it is `stored`.
struct StiffnessPattern {
  Stencil stencil;
  BlockMatrix matrix;
};
[[nodiscard]] StiffnessPattern stiffness_pattern(const Body& body, const std::vector<std::uint8_t>& active,
                                                 const ConnectionRows& connections,
                                                 const std::vector<CoupledElements>& coupled = {},
                                                 bool stored = true);

}  // namespace flexel::simulate
