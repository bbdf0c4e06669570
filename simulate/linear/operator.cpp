// One pass over the rows, each row summed in the order of its columns by one thread, so that the bits do not
// depend on the threads.
#include "simulate/linear/operator.h"

#include <cassert>

#include "base/parallel.h"

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

}  // namespace flexel::simulate
