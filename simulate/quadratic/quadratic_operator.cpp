// A product is made cell by cell, then gathered node by node in the order of the cells, so that it has the same
// bits for any number of threads.
#include "simulate/quadratic/quadratic_operator.h"

#include <algorithm>

#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kProductCellsAtATime = 32, kNodesAtATime = 512;
using CellValues = Eigen::Matrix<double, kCellUnknowns, 1>;

void multiply_packed(const double* packed, const CellValues& x, double* y) {
  Eigen::Map<CellValues> sum(y);
  sum.setZero();
  for (int i = 0; i < kCellUnknowns; ++i) {
    const Eigen::Map<const Eigen::VectorXd> row(packed, i);
    sum[i] += row.dot(x.head(i)) + packed[i] * x[i];
    sum.head(i) += x[i] * row;
    packed += i + 1;
  }
}

void turn_values(const Mat3& rotation, double* values) {
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    Eigen::Map<Vec3> value(values + 3 * n);
    value = (rotation * value).eval();
  }
}

}  // namespace

QuadraticOperator::QuadraticOperator(const QuadraticNodes& nodes, std::vector<std::uint8_t> held)
    : nodes_(nodes),
      held_(std::move(held)),
      which_(nodes.cells.size(), -1),
      no_blocks_(nodes.size() + 1, 0),
      cell_force_(nodes.cells.size() * kCellUnknowns) {}

std::uint32_t QuadraticOperator::add_shared(const CellMatrix& matrix) {
  shared_.push_back(matrix);
  return static_cast<std::uint32_t>(shared_.size() - 1);
}

void QuadraticOperator::reserve_own(const std::vector<std::uint32_t>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) which_[cells[i]] = static_cast<std::int32_t>(i);
  own_.assign(cells.size() * kPackedSize, 0);
}

void QuadraticOperator::set_own(std::size_t cell, const CellMatrix& matrix) {
  double* to = &own_[static_cast<std::size_t>(which_[cell]) * kPackedSize];
  for (int i = 0; i < kCellUnknowns; ++i)
    for (int j = 0; j <= i; ++j) *to++ = matrix(i, j);
}

CellMatrix QuadraticOperator::set_matrix(std::size_t cell) const {
  if (which_[cell] < 0) return shared_[static_cast<std::size_t>(-1 - which_[cell])];
  CellMatrix full;
  const double* from = &own_[static_cast<std::size_t>(which_[cell]) * kPackedSize];
  for (int i = 0; i < kCellUnknowns; ++i)
    for (int j = 0; j <= i; ++j) full(i, j) = full(j, i) = *from++;
  return full;
}

CellMatrix QuadraticOperator::matrix(std::size_t cell) const {
  CellMatrix full = set_matrix(cell);
  if (turns_.empty()) return full;
  const CellTurn& turn = turns_[cell];
  full.noalias() += turn.a * turn.gamma.transpose();
  full.noalias() += turn.gamma * turn.a.transpose();
  for (Eigen::Index a = 0; a < kCellUnknowns; a += 3)
    for (Eigen::Index b = 0; b < kCellUnknowns; b += 3)
      full.block<3, 3>(a, b) = (turn.rotation * full.block<3, 3>(a, b) * turn.rotation.transpose()).eval();
  return full;
}

Mat3 QuadraticOperator::block(std::size_t cell, std::size_t a, std::size_t b) const {
  const auto row = static_cast<Eigen::Index>(3 * a), column = static_cast<Eigen::Index>(3 * b);
  Mat3 found;
  if (which_[cell] < 0) {
    found = shared_[static_cast<std::size_t>(-1 - which_[cell])].block<3, 3>(row, column);
  } else {
    const double* packed = &own_[static_cast<std::size_t>(which_[cell]) * kPackedSize];
    for (Eigen::Index i = 0; i < 3; ++i)
      for (Eigen::Index j = 0; j < 3; ++j) {
        const Eigen::Index most = std::max(row + i, column + j), least = std::min(row + i, column + j);
        found(i, j) = packed[most * (most + 1) / 2 + least];
      }
  }
  if (turns_.empty()) return found;
  const CellTurn& turn = turns_[cell];
  found += turn.a.middleRows<3>(row) * turn.gamma.middleRows<3>(column).transpose() +
           turn.gamma.middleRows<3>(row) * turn.a.middleRows<3>(column).transpose();
  return turn.rotation * found * turn.rotation.transpose();
}

void QuadraticOperator::multiply_set(std::size_t cell, const Eigen::Matrix<double, kCellUnknowns, 4>& x,
                                     Eigen::Matrix<double, kCellUnknowns, 4>& product) const {
  if (which_[cell] < 0)
    product.noalias() = shared_[static_cast<std::size_t>(-1 - which_[cell])] * x;
  else
    product.noalias() = set_matrix(cell) * x;
}

void QuadraticOperator::clear_held(std::vector<Vec3>& values) const {
  for (std::size_t n = 0; n < held_.size(); ++n)
    for (int axis = 0; axis < 3; ++axis)
      if (held_[n] >> axis & 1) values[n][axis] = 0;
}

void QuadraticOperator::forces(const double* x, double* y) const {
  parallel_for_each(
      nodes_.cells.size(),
      [&](std::size_t c) {
        CellValues own;
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          for (std::size_t axis = 0; axis < 3; ++axis)
            own[static_cast<Eigen::Index>(3 * n + axis)] = x[3 * nodes_.of_cell[c][n] + axis];
        double* to = &cell_force_[c * kCellUnknowns];
        if (!turns_.empty()) turn_values(turns_[c].rotation.transpose(), own.data());
        if (which_[c] < 0)
          Eigen::Map<CellValues>(to).noalias() = shared_[static_cast<std::size_t>(-1 - which_[c])] * own;
        else
          multiply_packed(&own_[static_cast<std::size_t>(which_[c]) * kPackedSize], own, to);
        if (turns_.empty()) return;
        const CellTurn& turn = turns_[c];
        Eigen::Map<CellValues> sum(to);
        sum.noalias() += turn.a * (turn.gamma.transpose() * own).eval();
        sum.noalias() += turn.gamma * (turn.a.transpose() * own).eval();
        turn_values(turn.rotation, to);
      },
      kProductCellsAtATime);
  parallel_for_each(
      nodes_.size(),
      [&](std::size_t n) {
        double sum[3] = {0, 0, 0};
        for (const QuadraticNodes::Incidence& at : nodes_.at(n))
          for (std::size_t axis = 0; axis < 3; ++axis)
            sum[axis] += cell_force_[at.cell * kCellUnknowns + 3 * at.node + axis];
        for (std::size_t axis = 0; axis < 3; ++axis) y[3 * n + axis] = sum[axis];
      },
      kNodesAtATime);
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
    const CellMatrix cell = matrix(c);
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      const auto at = static_cast<Eigen::Index>(3 * n);
      blocks[nodes_.of_cell[c][n]] += cell.block<3, 3>(at, at);
    }
  }
  return blocks;
}

}  // namespace flexel::simulate
