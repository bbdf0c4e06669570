// Columns are ascending within a row, so a block is found by bisection.
#include "simulate/linear/block_matrix.h"

#include <algorithm>

namespace flexel::simulate {

std::size_t position_of(const BlockMatrix& matrix, std::size_t row, std::uint32_t column) {
  const auto begin = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[row]);
  const auto end = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[row + 1]);
  const auto found = std::lower_bound(begin, end, column);
  if (found == end || *found != column) throw MissingBlock("no block at that place of the matrix");
  return static_cast<std::size_t>(found - matrix.columns.begin());
}

std::size_t diagonal_position(const BlockMatrix& matrix, std::size_t row) {
  return position_of(matrix, row, static_cast<std::uint32_t>(row));
}

double largest_diagonal(const BlockMatrix& matrix) {
  double largest = 0;
  for (std::size_t row = 0; row < matrix.rows(); ++row) {
    largest =
        std::max(largest, matrix.values[diagonal_position(matrix, row)].diagonal().cwiseAbs().maxCoeff());
  }
  return largest;
}

}  // namespace flexel::simulate
