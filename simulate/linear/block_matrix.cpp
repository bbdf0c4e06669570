// Product of the block matrix with a vector: one pass over the rows, each row summed in the order of its
// columns by one thread, so that the bits do not depend on the threads.
#include "simulate/linear/block_matrix.h"

#include <algorithm>
#include <cassert>

#include "formats/parallel.h"

namespace flexel {

void multiply(const BlockMatrix& matrix, const std::vector<Vec3>& x, std::vector<Vec3>& y) {
  assert(x.size() == matrix.rows() && &x != &y);
  y.resize(matrix.rows());
  parallel_for_each(
      matrix.rows(),
      [&](std::size_t row) {
        Vec3 sum = Vec3::Zero();
        for (std::uint64_t q = matrix.row_offsets[row]; q < matrix.row_offsets[row + 1]; ++q) {
          sum.noalias() += matrix.values[q] * x[matrix.columns[q]];
        }
        y[row] = sum;
      },
      512);
}

std::size_t position_of(const BlockMatrix& matrix, std::size_t row, std::uint32_t column) {
  const auto begin = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[row]);
  const auto end = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.row_offsets[row + 1]);
  const auto found = std::lower_bound(begin, end, column);
  assert(found != end && *found == column);
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

}  // namespace flexel
