// Product of the block matrix with a vector: one pass over the rows, each row summed in the order of its
// columns by one thread, so that the bits do not depend on the threads.
#include "simulate/linear/block_matrix.h"

#include <algorithm>
#include <cassert>

#include "base/parallel.h"
#include "simulate/linear/operator.h"

namespace flexel::simulate {

void multiply(const BlockMatrix& matrix, const std::vector<Vec3>& x, std::vector<Vec3>& y) {
  multiply(StoredMatrix(matrix), x, y);
}

void multiply(const LinearOperator& matrix, const std::vector<Vec3>& x, std::vector<Vec3>& y) {
  assert(x.size() == matrix.rows() && &x != &y);
  y.resize(matrix.rows());
  if (!x.empty()) matrix.multiply(x.front().data(), y.front().data());
}

void StoredMatrix::multiply(const double* x, double* y) const {
  parallel_for_each(
      matrix_.rows(),
      [&](std::size_t row) {
        double sum[3] = {};
        for (std::uint64_t q = matrix_.row_offsets[row]; q < matrix_.row_offsets[row + 1]; ++q) {
          const double* block = matrix_.values[q].data();
          const double* from = x + 3 * std::size_t{matrix_.columns[q]};
          for (int r = 0; r < 3; ++r)
            sum[r] += block[3 * r] * from[0] + block[3 * r + 1] * from[1] + block[3 * r + 2] * from[2];
        }
        for (std::size_t r = 0; r < 3; ++r) y[3 * row + r] = sum[r];
      },
      512);
}

std::vector<Block> StoredMatrix::diagonal() const {
  std::vector<Block> diagonal(matrix_.rows());
  parallel_for_each(matrix_.rows(), [&](std::size_t row) {
    diagonal[row] = matrix_.values[diagonal_position(matrix_, row)];
  });
  return diagonal;
}

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
