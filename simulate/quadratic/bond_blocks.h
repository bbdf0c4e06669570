// Blocks of the Schwarz smoother across bonds: one for each bonded cell, of its nodes and those on the common surface of the cells that it
// is bonded with. What holds the two sides together is far stiffer than they are: blocks of one side alone would see that they move
// together as stiff, too.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "simulate/quadratic/cells/nitsche_bond.h"
#include "simulate/quadratic/quadratic_operator.h"

namespace flexel::simulate {

class BondBlocks {
 public:
  BondBlocks() = default;
  // Of two nodes a and b of a cell's stiffness, without the couplings.
  using CellBlock = std::function<Mat3(std::size_t cell, std::size_t a, std::size_t b)>;
  BondBlocks(const QuadraticOperator& matrix, const std::vector<BondedCells>& bonds, const CellBlock& block);

  // (cells) in whose place there is such a block.
  [[nodiscard]] bool has(std::size_t cell) const { return !of_cell_.empty() && of_cell_[cell]; }
  // How many blocks a node is in.
  [[nodiscard]] std::size_t count(std::size_t node) const {
    return offsets_.empty() ? 0 : offsets_[node + 1] - offsets_[node];
  }
  // Solves each block for `weight` times the residual. In parallel.
  void solve(const std::vector<double>& weight, const std::vector<Vec3>& residual);
  // Sum of what the last solve() gives a node.
  [[nodiscard]] Vec3 sum(std::size_t node) const;

 private:
  struct Part {
    std::vector<std::uint32_t> nodes;  // ascending
    std::size_t values = 0;            // where its three numbers a node begin
    Eigen::VectorXf scale;
    std::vector<float> inverse_factor;  // of Cholesky's, row by row
  };
  void choose_nodes(const QuadraticNodes& nodes, const std::vector<BondedCells>& bonds);
  [[nodiscard]] static Eigen::MatrixXd assembled(const Part& part, const QuadraticOperator& matrix,
                                                 const CellBlock& block);
  static void factorise(Part& part, const Eigen::MatrixXd& sum);

  std::vector<Part> parts_;
  std::vector<std::uint8_t> of_cell_;   // (cells)
  std::vector<std::uint32_t> offsets_;  // (nodes + 1)
  std::vector<std::size_t> places_;     // where a node's values are, in each of its blocks
  std::vector<float> values_;
};

}  // namespace flexel::simulate
