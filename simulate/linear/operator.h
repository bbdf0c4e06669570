// A symmetric matrix of 3x3 blocks as the solver reads it: products, and rows made when they are asked for,
// so that a tangent stiffness need not be stored (simulate/equilibrium/cell_stiffness.h).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "simulate/linear/block_matrix.h"

namespace flexel::simulate {

class LinearOperator {
 public:
  virtual ~LinearOperator() = default;

  // Where rows have blocks, as in BlockMatrix.
  [[nodiscard]] virtual std::span<const std::uint64_t> row_offsets() const = 0;
  [[nodiscard]] virtual std::span<const std::uint32_t> columns() const = 0;
  [[nodiscard]] std::size_t rows() const { return row_offsets().empty() ? 0 : row_offsets().size() - 1; }

  // y = A x, in parallel; the same bits for any thread count. x and y: (rows x 3).
  virtual void multiply(const double* x, double* y) const = 0;
  // The blocks of rows [begin, end) [N/m], in the order of columns(); made in `room` where they are not
  // stored. May be called by several threads, each with a room of its own.
  [[nodiscard]] virtual const Block* blocks(std::size_t begin, std::size_t end,
                                            std::vector<Block>& room) const = 0;
  // (rows) diagonal blocks.
  [[nodiscard]] virtual std::vector<Block> diagonal() const = 0;
};

// y = A x, rows in parallel; the same bits for any thread count. x and y: (rows x 3).
void multiply(const LinearOperator& matrix, const std::vector<Vec3>& x, std::vector<Vec3>& y);
void multiply(const BlockMatrix& matrix, const std::vector<Vec3>& x, std::vector<Vec3>& y);

// A matrix that is stored elsewhere.
class StoredMatrix final : public LinearOperator {
 public:
  explicit StoredMatrix(const BlockMatrix& matrix) : matrix_(matrix) {}
  [[nodiscard]] std::span<const std::uint64_t> row_offsets() const override { return matrix_.row_offsets; }
  [[nodiscard]] std::span<const std::uint32_t> columns() const override { return matrix_.columns; }
  void multiply(const double* x, double* y) const override;
  [[nodiscard]] const Block* blocks(std::size_t begin, std::size_t, std::vector<Block>&) const override {
    return matrix_.values.data() + matrix_.row_offsets[begin];
  }
  [[nodiscard]] std::vector<Block> diagonal() const override;

 private:
  const BlockMatrix& matrix_;
};

}  // namespace flexel::simulate
