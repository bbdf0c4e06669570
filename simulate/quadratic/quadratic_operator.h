// The stiffness over the nodes of model `quadratic`, cell by cell: no matrix is assembled.
#pragma once
#include "simulate/linear/operator.h"
#include "simulate/quadratic/cell_products.h"

namespace flexel::simulate {

class QuadraticOperator final : public LinearOperator {
 public:
  // Keeps a reference to `nodes`. `held`: (nodes) bit i: component i is prescribed; its row and column are those of
  // the identity.
  QuadraticOperator(const QuadraticNodes& nodes, CellProducts<double> cells, std::vector<std::uint8_t> held);

  [[nodiscard]] CellProducts<double>& cells() { return cells_; }
  [[nodiscard]] const CellProducts<double>& cells() const { return cells_; }
  [[nodiscard]] const QuadraticNodes& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<std::uint8_t>& held() const { return held_; }
  void clear_held(std::vector<Vec3>& values) const;

  // One row a node and no stored blocks: for conjugate_gradients().
  [[nodiscard]] std::span<const std::uint64_t> row_offsets() const override { return no_blocks_; }
  [[nodiscard]] std::span<const std::uint32_t> columns() const override { return {}; }
  void multiply(const double* x, double* y) const override;
  // The same without the rows of prescribed components, which get the forces that hold them.
  void forces(const double* x, double* y) const { cells_.forces(x, y); }
  [[nodiscard]] const Block* blocks(std::size_t, std::size_t, std::vector<Block>& room) const override {
    return room.data();
  }
  [[nodiscard]] std::vector<Block> diagonal() const override;

 private:
  const QuadraticNodes& nodes_;
  CellProducts<double> cells_;
  std::vector<std::uint8_t> held_;
  std::vector<std::uint64_t> no_blocks_;  // (nodes + 1) zeros
};

}  // namespace flexel::simulate
