// The stiffness over the nodes of model `quadratic`, cell by cell: no matrix is assembled. Prescribed components are left
// out of the cells' products and put back as rows of the identity.
#pragma once
#include "simulate/linear/operator.h"
#include "simulate/quadratic/cells/cell_products.h"

namespace flexel::simulate {

class QuadraticOperator final : public LinearOperator {
 public:
  // Keeps a reference to `nodes`. `held`: (nodes) bit i: component i is prescribed; its row and column are those of
  // the identity.
  QuadraticOperator(const QuadraticNodes& nodes, CellProducts<double> cells, std::vector<std::uint8_t> held)
      : nodes_(nodes), cells_(std::move(cells)), held_(std::move(held)), no_blocks_(nodes.size() + 1, 0) {}

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

inline void QuadraticOperator::clear_held(std::vector<Vec3>& values) const {
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (int axis = 0; axis < 3; ++axis)
      if (held_[n] >> axis & 1) values[n][axis] = 0;
}

// `x` is 0 in prescribed components but for those of the identity's rows.
inline void QuadraticOperator::multiply(const double* x, double* y) const {
  forces(x, y);
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (held_[n] >> axis & 1) y[3 * n + axis] = x[3 * n + axis];
}

inline std::vector<Block> QuadraticOperator::diagonal() const {
  std::vector<Block> blocks(nodes_.size(), Block::Zero());
  for (std::size_t c = 0; c < nodes_.cells.size(); ++c) {
    const CellMatrix cell = cells_.matrix(c);
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      const auto at = static_cast<Eigen::Index>(3 * n);
      blocks[nodes_.of_cell[c][n]] += cell.block<3, 3>(at, at);
    }
  }
  return blocks;
}

}  // namespace flexel::simulate
