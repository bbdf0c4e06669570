// Prescribed components are left out of the cells' products and put back as rows of the identity.
#include "simulate/quadratic/quadratic_operator.h"

namespace flexel::simulate {

QuadraticOperator::QuadraticOperator(const QuadraticNodes& nodes, CellProducts<double> cells,
                                     std::vector<std::uint8_t> held)
    : nodes_(nodes), cells_(std::move(cells)), held_(std::move(held)), no_blocks_(nodes.size() + 1, 0) {}

void QuadraticOperator::clear_held(std::vector<Vec3>& values) const {
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (int axis = 0; axis < 3; ++axis)
      if (held_[n] >> axis & 1) values[n][axis] = 0;
}

// `x` is 0 in prescribed components but for those of the identity's rows.
void QuadraticOperator::multiply(const double* x, double* y) const {
  forces(x, y);
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (held_[n] >> axis & 1) y[3 * n + axis] = x[3 * n + axis];
}

std::vector<Block> QuadraticOperator::diagonal() const {
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
