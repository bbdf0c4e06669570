// The stiffness over the nodes of model `quadratic`, cell by cell: no matrix is assembled. Whole cells of a part
// share one; a cell that the surface cuts, or that a support holds, has its own.
#pragma once
#include "simulate/linear/operator.h"
#include "simulate/quadratic/cell_integrals.h"
#include "simulate/quadratic/quadratic_nodes.h"

namespace flexel::simulate {

// A symmetric 81 x 81 matrix, its lower half row by row.
constexpr std::size_t kPackedSize = static_cast<std::size_t>(kCellUnknowns) * (kCellUnknowns + 1) / 2;

// What large deflections make of a cell's matrix K: R (K + a gamma^T + gamma a^T) R^T, node by node
// (simulate/quadratic/corotation.h).
struct CellTurn {
  Mat3 rotation = Mat3::Identity();
  Eigen::Matrix<double, kCellUnknowns, 3> a = Eigen::Matrix<double, kCellUnknowns, 3>::Zero(), gamma = a;
};

class QuadraticOperator final : public LinearOperator {
 public:
  // Keeps a reference to `nodes`. `held`: (nodes) bit i: component i is prescribed; its row and column are those of
  // the identity.
  QuadraticOperator(const QuadraticNodes& nodes, std::vector<std::uint8_t> held);

  // The number of a matrix that several cells share.
  std::uint32_t add_shared(const CellMatrix& matrix);
  void share(std::size_t cell, std::uint32_t shared) {
    which_[cell] = -1 - static_cast<std::int32_t>(shared);
  }
  void set_own(std::size_t cell, const CellMatrix& matrix);
  // Room for own matrices, before they are set from several threads.
  void reserve_own(const std::vector<std::uint32_t>& cells);

  // (cells) From now on every cell's matrix is turned; those that were set stay as they are.
  void turn(std::vector<CellTurn> turns) { turns_ = std::move(turns); }

  [[nodiscard]] bool has_own(std::size_t cell) const { return which_[cell] >= 0; }
  [[nodiscard]] CellMatrix matrix(std::size_t cell) const;
  // Of two of the cell's nodes.
  [[nodiscard]] Mat3 block(std::size_t cell, std::size_t a, std::size_t b) const;
  // K x of a cell, not turned.
  void multiply_set(std::size_t cell, const Eigen::Matrix<double, kCellUnknowns, 4>& x,
                    Eigen::Matrix<double, kCellUnknowns, 4>& product) const;
  [[nodiscard]] const QuadraticNodes& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<std::uint8_t>& held() const { return held_; }
  void clear_held(std::vector<Vec3>& values) const;

  // One row a node and no stored blocks: for conjugate_gradients().
  [[nodiscard]] std::span<const std::uint64_t> row_offsets() const override { return no_blocks_; }
  [[nodiscard]] std::span<const std::uint32_t> columns() const override { return {}; }
  void multiply(const double* x, double* y) const override;
  // The same without the rows of prescribed components, which get the forces that hold them.
  void forces(const double* x, double* y) const;
  [[nodiscard]] const Block* blocks(std::size_t, std::size_t, std::vector<Block>& room) const override {
    return room.data();
  }
  [[nodiscard]] std::vector<Block> diagonal() const override;

 private:
  [[nodiscard]] CellMatrix set_matrix(std::size_t cell) const;

  const QuadraticNodes& nodes_;
  std::vector<std::uint8_t> held_;
  std::vector<std::int32_t> which_;  // (cells) own matrix, or -1 - shared one
  std::vector<CellMatrix> shared_;
  std::vector<double> own_;                 // (own x kPackedSize)
  std::vector<CellTurn> turns_;             // (cells), or none
  std::vector<std::uint64_t> no_blocks_;    // (nodes + 1) zeros
  mutable std::vector<double> cell_force_;  // (cells x 81)
};

}  // namespace flexel::simulate
