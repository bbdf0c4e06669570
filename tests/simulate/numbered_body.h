// Bodies whose elements are numbered otherwise than along the lattice, as those of coarse lattices are.
#pragma once
#include "tests/simulate/box_body.h"

namespace flexel::simulate::testing {

// (elements) `to[e]`: the number that element e gets.
inline Body renumbered(const Body& body, const std::vector<std::uint32_t>& to) {
  Body result = body;
  for (std::size_t e = 0; e < to.size(); ++e) {
    result.lattice_index[to[e]] = body.lattice_index[e];
    result.piece[to[e]] = body.piece[e];
    result.rest[to[e]] = body.rest[e];
    result.position[to[e]] = body.position[e];
  }
  for (std::array<std::uint32_t, 8>& elements : result.cell_elements)
    for (std::uint32_t& e : elements) e = to[e];
  return result;
}

// Cells along x that share no element; at each of their corners the elements are numbered in a row all the
// same: all lowest corners first, then the next ones.
inline Body cells_beside_gaps(std::uint32_t count, double spacing) {
  BoxOptions options;
  options.cells = {2 * static_cast<int>(count), 1, 1};
  options.spacing = Vec3::Constant(spacing);
  options.fill = [](int i, int, int) { return i % 2 == 0 ? 1.0 : 0.0; };
  const Body body = box_body(options);
  std::vector<std::uint32_t> to(body.element_count());
  for (std::uint32_t c = 0; c < count; ++c)
    for (std::uint32_t a = 0; a < 8; ++a) to[body.cell_elements[c][a]] = a * count + c;
  return renumbered(body, to);
}

}  // namespace flexel::simulate::testing
