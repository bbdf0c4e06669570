// Prescribed components: imposed on the displacement, cleared from residuals, and eliminated from the matrix
// symmetrically.
#include "simulate/conditions/constraints.h"

#include <bit>

#include "base/parallel.h"

namespace flexel::simulate {

void apply(const Constraints& constraints, const Body& body, const State& state,
           std::vector<Vec3>& displacement) {
  parallel_for_each(constraints.mask.size(), [&](std::size_t e) {
    if (!constraints.mask[e]) return;
    for (int axis = 0; axis < 3; ++axis)
      if (constraints.mask[e] >> axis & 1) {
        const std::uint32_t motion = constraints.motion[e][static_cast<std::size_t>(axis)];
        displacement[e][axis] = constraints.path(body, static_cast<std::uint32_t>(e), axis,
                                                 constraints.courses[motion].at(state));
      }
  });
}

std::size_t count_unknowns(const Constraints& constraints, std::size_t elements) {
  std::size_t unknowns = 3 * elements;
  for (const std::uint8_t axes : constraints.mask)
    unknowns -= static_cast<std::size_t>(std::popcount(static_cast<unsigned>(axes & 7)));
  return unknowns;
}

void clear_prescribed(const Constraints& constraints, std::vector<Vec3>& values) {
  parallel_for_each(constraints.mask.size(), [&](std::size_t e) {
    for (int axis = 0; axis < 3; ++axis)
      if (constraints.mask[e] >> axis & 1) values[e][axis] = 0;
  });
}

void eliminate(const Constraints& constraints, BlockMatrix& matrix) {
  const auto& mask = constraints.mask;
  parallel_for_each(matrix.rows(), [&](std::size_t row) {
    for (std::size_t entry = matrix.row_offsets[row]; entry < matrix.row_offsets[row + 1]; ++entry) {
      const std::uint32_t column = matrix.columns[entry];
      if (!mask[row] && !mask[column]) continue;
      Block& block = matrix.values[entry];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          if (!(mask[row] >> i & 1) && !(mask[column] >> j & 1)) continue;
          if (row != column || i != j)
            block(i, j) = 0;
          else if (!(block(i, j) > 0))
            block(i, j) = 1;
        }
    }
  });
}

}  // namespace flexel::simulate
