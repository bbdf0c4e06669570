// See direct.h. Unknowns whose diagonal is next to nothing (rotations of degenerate aggregates, elements
// without stiffness) get a diagonal of the matrix's own size, which holds them still.
#include "simulate/linear/direct.h"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "base/stop.h"

namespace flexel::simulate {

namespace {

using Order = Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int>;
using Lower = Eigen::SparseMatrix<double>;
constexpr int kWidest = 64;  // columns of a supernode

// The lower half of the matrix with its rows and columns in another order.
Lower in_order(const Lower& lower, const Order& order) {
  Lower permuted(lower.rows(), lower.cols());
  permuted.selfadjointView<Eigen::Lower>() = lower.selfadjointView<Eigen::Lower>().twistedBy(order);
  return permuted;
}

// Liu's elimination tree (1990): (columns) the one that a column's elimination changes next, -1 for none; and how many entries the
// factor has below the diagonal. `upper`: by columns.
void elimination_tree(const Lower& upper, std::vector<int>& parent, std::vector<int>& below) {
  const auto size = static_cast<std::size_t>(upper.cols());
  parent.assign(size, -1);
  below.assign(size, 0);
  std::vector<int> seen(size, -1);
  for (int k = 0; k < upper.cols(); ++k) {
    check_stop();
    seen[k] = k;
    for (Lower::InnerIterator entry(upper, k); entry; ++entry)
      for (int i = static_cast<int>(entry.row()); i < k && seen[i] != k; i = parent[i]) {
        if (parent[i] < 0) parent[i] = k;
        ++below[i];
        seen[i] = k;
      }
  }
}

// (columns) their places when each comes after all that lie under it in the tree, next to one another.
Order postorder(const std::vector<int>& parent) {
  const int size = static_cast<int>(parent.size());
  std::vector<int> first(parent.size(), -1), next(parent.size(), -1), stack;
  for (int i = size - 1; i >= 0; --i) {
    if (parent[i] < 0) continue;
    next[i] = first[parent[i]];
    first[parent[i]] = i;
  }
  Order order(size);
  int place = 0;
  for (int root = 0; root < size; ++root) {
    if (parent[root] >= 0) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const int top = stack.back();
      if (first[top] >= 0) {
        stack.push_back(first[top]);
        first[top] = next[first[top]];
        continue;
      }
      order.indices()[top] = place++;
      stack.pop_back();
    }
  }
  return order;
}

}  // namespace

void DirectSolver::analyse(const Lower& lower) {
  Order places;
  Eigen::AMDOrdering<int>()(lower.selfadjointView<Eigen::Lower>(), places);
  order_ = places.inverse();
  std::vector<int> parent, below;
  const auto tree = [&] {
    Lower upper(lower.rows(), lower.cols());
    upper.selfadjointView<Eigen::Upper>() = lower.selfadjointView<Eigen::Lower>().twistedBy(order_);
    elimination_tree(upper, parent, below);
  };
  tree();
  order_ = postorder(parent) * order_;
  tree();
  find_supernodes(parent, below);
  find_rows(in_order(lower, order_));
}

void DirectSolver::find_supernodes(const std::vector<int>& parent, const std::vector<int>& below) {
  supernodes_.clear();
  supernode_of_.assign(parent.size(), 0);
  std::size_t rows = 0, values = 0;
  for (int j = 0; j < static_cast<int>(parent.size()); ++j) {
    const bool goes_on =
        j > 0 && parent[j - 1] == j && below[j - 1] == below[j] + 1 && supernodes_.back().width < kWidest;
    if (!goes_on) supernodes_.push_back({j, 0, 0, 0, 0});
    ++supernodes_.back().width;
    supernodes_.back().below = static_cast<std::size_t>(below[j]);
    supernode_of_[j] = static_cast<int>(supernodes_.size()) - 1;
  }
  for (Supernode& each : supernodes_) {
    each.rows = rows;
    each.values = values;
    rows += each.below;
    values += height(each) * static_cast<std::size_t>(each.width);
  }
  rows_.resize(rows);
  values_.resize(values);
}

// Those of the matrix, and those of the supernodes whose first row below lies in this one.
void DirectSolver::find_rows(const Lower& lower) {
  std::vector<int> seen(supernode_of_.size(), -1);
  std::vector<std::vector<int>> children(supernodes_.size());
  for (int s = 0; s < static_cast<int>(supernodes_.size()); ++s) {
    check_stop();
    const Supernode& node = supernodes_[s];
    std::size_t next = node.rows;
    const auto add = [&](int row) {
      if (row < node.first + node.width || seen[row] == s) return;
      seen[row] = s;
      rows_[next++] = row;
    };
    for (int c = node.first; c < node.first + node.width; ++c)
      for (Lower::InnerIterator entry(lower, c); entry; ++entry) add(static_cast<int>(entry.row()));
    for (const int child : children[s])
      for (std::size_t r = 0; r < supernodes_[child].below; ++r) add(rows_[supernodes_[child].rows + r]);
    assert(next == node.rows + node.below);
    if (node.below == 0) continue;
    std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(node.rows),
              rows_.begin() + static_cast<std::ptrdiff_t>(next));
    children[supernode_of_[rows_[node.rows]]].push_back(s);
  }
}

void DirectSolver::factorise(const Lower& lower) {
  constexpr double kShift = 1e-9;
  if (lower.rows() == 0) return;
  Lower shifted = lower;
  const Eigen::VectorXd diagonal = shifted.diagonal();
  const double largest = diagonal.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < diagonal.size(); ++i) {
    const bool absent = std::abs(diagonal[i]) <= 1e-14 * largest;
    shifted.coeffRef(i, i) += absent ? (largest > 0 ? largest : 1) : kShift * diagonal[i];
  }
  if (inverse_pivots_.size() == 0) analyse(shifted);
  shifted = in_order(shifted, order_);
  pivots_.setZero(lower.rows());
  inverse_pivots_.setZero(lower.rows());
  local_.assign(supernode_of_.size(), 0);
  constexpr int kNone = -1;
  // The supernodes whose next row below lies in each one, as lists, and which row that is.
  std::vector<int> waiting(supernodes_.size(), kNone), next(supernodes_.size(), kNone);
  std::vector<std::size_t> position(supernodes_.size(), 0);
  const auto wait = [&](int s) {
    if (position[s] == supernodes_[s].below) return;
    int& list = waiting[supernode_of_[rows_[supernodes_[s].rows + position[s]]]];
    next[s] = list;
    list = s;
  };
  for (int s = 0; s < static_cast<int>(supernodes_.size()); ++s) {
    const Supernode& node = supernodes_[s];
    Panel panel(&values_[node.values], static_cast<Eigen::Index>(height(node)), node.width);
    panel.setZero();
    for (int c = 0; c < node.width; ++c) local_[node.first + c] = c;
    for (std::size_t r = 0; r < node.below; ++r)
      local_[rows_[node.rows + r]] = node.width + static_cast<int>(r);
    for (int c = 0; c < node.width; ++c)
      for (Lower::InnerIterator entry(shifted, node.first + c); entry; ++entry)
        panel(local_[entry.row()], c) = entry.value();
    for (int from = waiting[s], after = kNone; from != kNone; from = after) {
      check_stop();
      after = next[from];
      const Supernode& other = supernodes_[from];
      std::size_t end = position[from];
      while (end < other.below && rows_[other.rows + end] < node.first + node.width) ++end;
      update(other, position[from], end, panel);
      position[from] = end;
      wait(from);
    }
    eliminate(node, 1e-15 * largest, panel);
    wait(s);
  }
}

// Takes L D L^T of the columns of `from` away, in the columns that its rows from `begin` to `end` are.
void DirectSolver::update(const Supernode& from, std::size_t begin, std::size_t end, Panel& panel) {
  const auto rows = static_cast<Eigen::Index>(from.below - begin),
             columns = static_cast<Eigen::Index>(end - begin);
  const Panel other(&values_[from.values], static_cast<Eigen::Index>(height(from)), from.width);
  const auto lower = other.bottomRows(rows);
  product_.resize(std::max(product_.size(), static_cast<std::size_t>(rows * columns)));
  Panel product(product_.data(), rows, columns);
  product.noalias() =
      lower * (lower.topRows(columns) * pivots_.segment(from.first, from.width).asDiagonal()).transpose();
  const int* at = &rows_[from.rows + begin];
  for (Eigen::Index c = 0; c < columns; ++c) {
    double* to = panel.col(local_[at[c]]).data();
    const double* values = product.col(c).data();
    for (Eigen::Index r = c; r < rows; ++r) to[local_[at[r]]] -= values[r];
  }
}

// LDL^T of the columns of a supernode. A pivot of zero or not a number (a singular matrix) drops its unknown.
void DirectSolver::eliminate(const Supernode& node, double least, Panel& panel) {
  const Eigen::Index width = node.width;
  for (Eigen::Index c = 0; c < width; ++c) {
    const double pivot = panel(c, c);
    const bool counts = std::abs(pivot) > least;
    pivots_[node.first + c] = counts ? pivot : 0;
    inverse_pivots_[node.first + c] = counts ? 1 / std::abs(pivot) : 0;
    const Eigen::Index left = width - c - 1;
    auto column = panel.col(c).segment(c + 1, left);
    if (!counts) {
      column.setZero();
      continue;
    }
    for (Eigen::Index k = 0; k < left; ++k)
      panel.col(c + 1 + k).segment(c + 1 + k, left - k) -= column[k] / pivot * column.tail(left - k);
    column /= pivot;
  }
  auto below = panel.bottomRows(static_cast<Eigen::Index>(node.below));
  panel.topRows(width).triangularView<Eigen::UnitLower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
  for (Eigen::Index c = 0; c < width; ++c) {
    const double pivot = pivots_[node.first + c];
    below.col(c) *= pivot == 0 ? 0 : 1 / pivot;
  }
}

void DirectSolver::solve(double* x) const {
  if (inverse_pivots_.size() == 0) return;
  Eigen::Map<Eigen::VectorXd> vector(x, inverse_pivots_.size());
  work_.noalias() = order_ * vector;
  const auto below_of = [&](const Supernode& node) {
    below_.resize(std::max(below_.size(), node.below));
    return Eigen::Map<Eigen::VectorXd>(below_.data(), static_cast<Eigen::Index>(node.below));
  };
  const auto panel = [&](const Supernode& node) {
    return Eigen::Map<const Eigen::MatrixXd>(&values_[node.values], static_cast<Eigen::Index>(height(node)),
                                             node.width);
  };
  for (const Supernode& node : supernodes_) {
    const auto values = panel(node);
    auto own = work_.segment(node.first, node.width);
    values.topRows(node.width).triangularView<Eigen::UnitLower>().solveInPlace(own);
    auto below = below_of(node);
    below.noalias() = values.bottomRows(below.size()) * own;
    for (std::size_t r = 0; r < node.below; ++r) work_[rows_[node.rows + r]] -= below_[r];
  }
  work_.array() *= inverse_pivots_.array();
  for (auto node = supernodes_.rbegin(); node != supernodes_.rend(); ++node) {
    const auto values = panel(*node);
    auto own = work_.segment(node->first, node->width);
    const auto below = below_of(*node);
    for (std::size_t r = 0; r < node->below; ++r) below_[r] = work_[rows_[node->rows + r]];
    own.noalias() -= values.bottomRows(below.size()).transpose() * below;
    values.topRows(node->width).triangularView<Eigen::UnitLower>().transpose().solveInPlace(own);
  }
  vector.noalias() = order_.transpose() * work_;
}

namespace {

// (rows) The row that is eliminated first, second ...
std::vector<std::size_t> elimination_order(const LinearOperator& matrix) {
  const auto n = static_cast<Eigen::Index>(matrix.rows());
  std::vector<Eigen::Triplet<char>> lower;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (std::uint64_t q = matrix.row_offsets()[row]; q < matrix.row_offsets()[row + 1]; ++q)
      if (matrix.columns()[q] <= row)
        lower.emplace_back(i, static_cast<Eigen::Index>(matrix.columns()[q]), 1);
  }
  Eigen::SparseMatrix<char> pattern(n, n);
  pattern.setFromTriplets(lower.begin(), lower.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(pattern.selfadjointView<Eigen::Lower>(), order);
  return {order.indices().begin(), order.indices().end()};
}

}  // namespace

bool factor_takes_at_most(const LinearOperator& matrix, double multiplications) {
  // In a solid the order alone takes longer than the answer is worth.
  constexpr std::size_t kManyRows = 20'000;
  constexpr double kSolid = 22;  // couplings a row; 27 within a solid, 21 in a wall of two cells
  const auto rows = static_cast<double>(matrix.rows());
  if (matrix.rows() > kManyRows && static_cast<double>(matrix.row_offsets()[matrix.rows()]) > kSolid * rows)
    return false;
  const std::vector<std::size_t> order = elimination_order(matrix);
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> place(order.size()), parent(order.size(), kNone), seen(order.size(), kNone);
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = k;
  // The paths of the elimination tree from what row k couples with up to k are row k of the factor (Liu 1990).
  std::vector<double> column(order.size(), 0);  // blocks below the diagonal
  double squares = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    check_stop();
    seen[k] = k;
    for (std::uint64_t q = matrix.row_offsets()[order[k]]; q < matrix.row_offsets()[order[k] + 1]; ++q)
      for (std::size_t i = place[matrix.columns()[q]]; i < k && seen[i] != k; i = parent[i]) {
        if (parent[i] == kNone) parent[i] = k;
        squares += 2 * column[i] + 1;
        column[i] += 1;
        seen[i] = k;
      }
    if (13.5 * squares > multiplications) return false;
  }
  return true;
}

}  // namespace flexel::simulate
