// Sparse symmetric matrix of 3x3 blocks, compressed rows: the tangent stiffness over the elements.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct BlockMatrix {
  std::vector<std::uint64_t> row_offsets;  // (rows + 1)
  std::vector<std::uint32_t> columns;      // (blocks) ascending within a row; the diagonal is always present
  std::vector<Block> values;               // (blocks) N/m
  [[nodiscard]] std::size_t rows() const { return row_offsets.empty() ? 0 : row_offsets.size() - 1; }
};

// What position_of() throws where there is no block: our own fault, unless it is asked for (Mechanics).
struct MissingBlock : std::logic_error {
  using std::logic_error::logic_error;
};

// Position in `columns` of the block of `row` and `column`, which must be there, and of the diagonal one.
[[nodiscard]] std::size_t position_of(const BlockMatrix& matrix, std::size_t row, std::uint32_t column);
[[nodiscard]] std::size_t diagonal_position(const BlockMatrix& matrix, std::size_t row);

// Largest magnitude among the diagonal entries.
[[nodiscard]] double largest_diagonal(const BlockMatrix& matrix);

}  // namespace flexel::simulate
