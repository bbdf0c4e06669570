// The preconditioner of model `quadratic`: p-multigrid.
//
// Chebyshev(2) before and after, smoothed by additive Schwarz: one block (all 27 nodes of the assembled stiffness) a cell
// that is filled less than 70 % or that a support holds, and 3 x 3 blocks of all other nodes; across bonds the blocks of
// bond_blocks.h. What several blocks say of a node counts by the square root of the share that each one's cell has in the
// node's stiffness, on both sides: with even shares slivers say as much as what holds them, and the largest eigenvalue is three
// times as large, the iterations up to twice as many (measured). Beside bonds shares are even. Between them the trilinear
// field on the same lattice: its Galerkin operator P^T K P, factorised where that takes little, else by the hierarchy of
// simulate/linear/multigrid.h. Without the blocks of the cut cells conjugate gradients need some
// thirty times the iterations (measured). Products and blocks are in single precision.
#pragma once
#include <memory>

#include "simulate/linear/preconditioner.h"
#include "simulate/models/stiffness.h"
#include "simulate/quadratic/bond_blocks.h"

namespace flexel::simulate {

class QuadraticMultigrid final : public Preconditioner {
 public:
  // Keeps references to the first two. `displacement`: (nodes x 3) m, where the matrix is the tangent; none: at rest.
  // `bonds`: those whose couplings the matrix has. `held_softly`: (elements of the body) N/m that the trilinear field is
  // held with besides, where rigid motions are free; none: nothing.
  QuadraticMultigrid(const QuadraticOperator& matrix, const Body& body, const std::vector<BondedCells>& bonds,
                     const std::vector<Vec3>& displacement = {}, const std::vector<double>& held_softly = {});
  QuadraticMultigrid(const QuadraticMultigrid&) = delete;
  QuadraticMultigrid& operator=(const QuadraticMultigrid&) = delete;

  void apply(const std::vector<Vec3>& residual, std::vector<Vec3>& correction) const override;
  void refresh() override {}
  // Where it shows as not positive: the largest eigenvalue was taken too small. It is twice that from here on.
  void widen() { largest_ *= 2; }

  // The trilinear operator over the elements that are nodes, and where they are.
  [[nodiscard]] const BlockMatrix& coarse() const { return coarse_; }
  [[nodiscard]] const NodeGeometry& geometry() const { return geometry_; }

 private:
  struct CellStiffness;
  void make_transfer();
  void make_coarse(const Body& body, const std::vector<Vec3>& displacement, const CellStiffness& cells);
  void make_blocks(const CellStiffness& cells, const std::vector<BondedCells>& bonds);
  void make_weights(const CellStiffness& cells);
  void factorise(std::size_t first, const CellStiffness& cells);
  static void factorise_raised(const std::array<double, quadratic_kernel::kFactorSize>& sum,
                               quadratic_kernel::Triangle& to);
  void estimate_largest();
  // y = K x, 0 in prescribed components
  void multiply_roughly(const std::vector<Vec3>& x, std::vector<Vec3>& y) const;
  // correction = M^-1 residual, M the Schwarz smoother
  void smooth_once(const std::vector<Vec3>& residual, std::vector<Vec3>& correction) const;
  void chebyshev(const std::vector<Vec3>& b, std::vector<Vec3>& x, bool from_zero) const;
  void add_coarse_correction(const std::vector<Vec3>& b, std::vector<Vec3>& x) const;

  const QuadraticOperator& matrix_;
  CellProducts<float> cells_;
  // (nodes) the elements that a node lies between, with even weights
  std::vector<std::uint32_t> from_offsets_, from_;
  std::vector<std::uint32_t> to_offsets_, to_;  // transposed: nodes of each element
  BlockMatrix coarse_;
  NodeGeometry geometry_;
  std::unique_ptr<Preconditioner> hierarchy_;
  std::vector<std::uint32_t> block_cells_;                   // cells that have a block
  std::vector<quadratic_kernel::Triangle> inverse_factors_;  // (blocks) inverse of Cholesky's factor
  std::vector<std::int32_t> block_of_;                       // (cells) or -1
  mutable BondBlocks bond_blocks_;
  std::vector<double> weight_;       // (nodes) 1 / sqrt(multiplicity), of bond_blocks_; 0: not in any block
  std::vector<float> block_weight_;  // (blocks x 27) of a block's nodes
  std::vector<Block> inverse_;       // (nodes) of the diagonal block, where weight_ is 0
  double largest_ = 1;               // eigenvalue of M^-1 A
  mutable std::vector<float> block_values_;  // (blocks x kPaddedUnknowns)
};

}  // namespace flexel::simulate
