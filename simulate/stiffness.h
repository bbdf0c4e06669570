// The tangent stiffness over the elements and where each cell's blocks go in it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "formats/body.h"
#include "simulate/linear/block_matrix.h"

namespace flexel {

using CellPair = std::array<std::uint32_t, 2>;

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
// its diagonal always present. The elements of two cells of `coupled` are neighbours as those of one cell
// are.
struct StiffnessPattern {
  Stencil stencil;
  BlockMatrix matrix;
};
[[nodiscard]] StiffnessPattern stiffness_pattern(const Body& body, const std::vector<std::uint8_t>& active,
                                                 const std::vector<CellPair>& coupled = {});

// Where block (a, b) of a cell is in the matrix's values.
[[nodiscard]] inline std::size_t block_index(const Stencil& stencil, const BlockMatrix& matrix,
                                             const Body& body, std::uint32_t cell, std::size_t a,
                                             std::size_t b) {
  return matrix.row_offsets[body.cell_elements[cell][a]] + stencil.slot[cell][8 * a + b];
}

}  // namespace flexel
