// Prescribed components are 0 in every residual and correction.
#include "simulate/quadratic/quadratic_multigrid.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "simulate/conditions/constraints.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr int kSteps = 2;            // of Chebyshev's iteration, before and after
constexpr double kRange = 16;        // largest over smallest eigenvalue that it damps
constexpr double kFullEnough = 0.7;  // cells filled so far are as good without a block (measured)
constexpr double kMargin = 1.2;      // over the estimate of the largest
constexpr std::size_t kLanczosSteps = 8, kMostLanczosSteps = 30;
constexpr double kRaised = 1e-6;  // of a block's scaled diagonal: what it is made from is in single precision
// Multiplications an element that a factor of the trilinear field may take: about what the iterations cost that it saves.
constexpr double kFactorCost = 1e5;
constexpr std::size_t kBlocksAtATime = 16;
using Vector = std::vector<Vec3>;
using BlockTriangle = std::array<double, quadratic_kernel::kFactorSize>;

double greatest_eigenvalue(const std::vector<double>& diagonal, const std::vector<double>& beside) {
  const auto size = static_cast<Eigen::Index>(diagonal.size());
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(Eigen::Map<const Eigen::VectorXd>(diagonal.data(), size),
                                Eigen::Map<const Eigen::VectorXd>(beside.data(), size - 1),
                                Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[size - 1];
}

// A cell that has a node of a block: which of the block's nodes that is, and which of its own.
struct SharedNode {
  std::uint32_t cell, here, there;
};

// (nodes of a cell with their cells) by cell, then in the order of the block's nodes.
std::vector<SharedNode> shared_nodes(const QuadraticNodes& nodes, std::uint32_t cell) {
  std::vector<SharedNode> shared;
  for (std::uint32_t n = 0; n < kQuadraticNodes; ++n)
    for (const QuadraticNodes::Incidence& at : nodes.at(nodes.of_cell[cell][n]))
      shared.push_back({at.cell, n, at.node});
  std::stable_sort(shared.begin(), shared.end(),
                   [](const SharedNode& a, const SharedNode& b) { return a.cell < b.cell; });
  return shared;
}

}  // namespace

// Of all cells, while the rest is made from it. Cells that have the same matrix share it.
struct QuadraticMultigrid::CellStiffness {
  std::vector<std::size_t> place;  // (cells)
  std::vector<float> nodes;        // (places x kNodeMatrix) CellBlocks
  std::vector<double> corners;     // (places x kCornerMatrix)

  CellStiffness(const CellProducts<double>& cells, std::size_t count) : place(count) {
    using quadratic_kernel::kCornerMatrix, quadratic_kernel::kNodeMatrix;
    const std::vector<std::uint32_t> twins = cells.twins();
    std::size_t others = 0;
    for (std::uint32_t c = 0; c < count; ++c)
      if (twins[c] == c) place[c] = others++;
    for (std::size_t c = 0; c < count; ++c) place[c] = place[twins[c]];
    nodes.resize(others * kNodeMatrix);
    corners.resize(others * kCornerMatrix);
    cells.matrices([&](std::uint32_t c, const CellBlocks& blocks) {
      float* to = &nodes[place[c] * kNodeMatrix];
      for (std::size_t i = 0; i < kNodeMatrix; ++i) to[i] = static_cast<float>(blocks.nodes[i]);
      std::copy(blocks.corners.begin(), blocks.corners.end(), &corners[place[c] * kCornerMatrix]);
    });
  }

  // (3 x 3, row by row) Of two of a cell's nodes, a >= b.
  [[nodiscard]] const float* lower_block(std::size_t cell, std::size_t a, std::size_t b) const {
    return &nodes[place[cell] * quadratic_kernel::kNodeMatrix + quadratic_kernel::block_place(a, b)];
  }
  // Of two of a cell's nodes.
  [[nodiscard]] Mat3 block(std::size_t cell, std::size_t a, std::size_t b) const {
    using Rows = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
    const Eigen::Map<const Rows> found(lower_block(cell, std::max(a, b), std::min(a, b)));
    return a >= b ? Mat3(found.cast<double>()) : Mat3(found.transpose().cast<double>());
  }
  // Of two of a cell's corners.
  [[nodiscard]] Mat3 corner_block(std::size_t cell, std::size_t a, std::size_t b) const {
    using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Map<const Rows> found(
        &corners[place[cell] * quadratic_kernel::kCornerMatrix +
                 quadratic_kernel::block_place(std::max(a, b), std::min(a, b))]);
    return a >= b ? Mat3(found) : Mat3(found.transpose());
  }

  // The lower triangle of the assembled stiffness of a cell's nodes, as kernel_quadratic_matrix.h has it.
  void assemble(const QuadraticNodes& of, const std::vector<std::uint8_t>& held, std::uint32_t cell,
                BlockTriangle& sum) const {
    sum.fill(0);
    const std::vector<SharedNode> shared = shared_nodes(of, cell);
    for (std::size_t begin = 0, end = 0; begin < shared.size(); begin = end) {
      while (end < shared.size() && shared[end].cell == shared[begin].cell) ++end;
      for (std::size_t p = begin; p < end; ++p)
        for (std::size_t q = begin; q <= p; ++q) add(shared[p], shared[q], sum);
    }
    const auto entry = [&](std::size_t row, std::size_t column) -> double& {
      return sum[quadratic_kernel::row_place(row) + column];
    };
    for (std::size_t i = 0; i < quadratic_kernel::kUnknowns; ++i) {
      if (!(held[of.of_cell[cell][i / 3]] >> i % 3 & 1)) continue;
      for (std::size_t j = 0; j < i; ++j) entry(i, j) = 0;
      for (std::size_t j = i + 1; j < quadratic_kernel::kUnknowns; ++j) entry(j, i) = 0;
      entry(i, i) = 1;
    }
  }

 private:
  // `row` comes after `column` in the block.
  void add(const SharedNode& row, const SharedNode& column, BlockTriangle& sum) const {
    const bool lower = row.there >= column.there;
    const float* from =
        lower_block(row.cell, std::max(row.there, column.there), std::min(row.there, column.there));
    for (std::size_t i = 0; i < 3; ++i) {
      double* to = &sum[quadratic_kernel::row_place(3 * row.here + i) + 3 * column.here];
      const std::size_t count = row.here == column.here ? i + 1 : 3;
      for (std::size_t j = 0; j < count; ++j)
        to[j] += static_cast<double>(lower ? from[3 * i + j] : from[3 * j + i]);
    }
  }
};

QuadraticMultigrid::QuadraticMultigrid(const QuadraticOperator& matrix, const Body& body,
                                       const std::vector<BondedCells>& bonds,
                                       const std::vector<Vec3>& displacement,
                                       const std::vector<double>& held_softly)
    : matrix_(matrix), cells_(matrix.cells()) {
  make_transfer();
  {
    const CellStiffness cells(matrix.cells(), matrix.nodes().cells.size());
    make_coarse(body, displacement, cells);
    make_blocks(cells, bonds);
  }
  for (std::size_t e = 0; e < coarse_.rows() && !held_softly.empty(); ++e)
    coarse_.values[diagonal_position(coarse_, e)].diagonal().array() +=
        held_softly[matrix.nodes().elements[e]];
  hierarchy_ = aggregation_multigrid(coarse_, geometry_, {.row_cost = kFactorCost});
  estimate_largest();
}

void QuadraticMultigrid::make_transfer() {
  const QuadraticNodes& nodes = matrix_.nodes();
  from_offsets_.assign(1, 0);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const QuadraticNodes::Incidence& at = nodes.at(n).front();
    for (std::size_t a = 0; a < 8; ++a)
      if (trilinear_weight(at.node, a) > 0) from_.push_back(nodes.of_cell[at.cell][node_of_corner(a)]);
    from_offsets_.push_back(static_cast<std::uint32_t>(from_.size()));
  }
  to_offsets_.assign(nodes.elements.size() + 1, 0);
  for (const std::uint32_t element : from_) ++to_offsets_[element + 1];
  for (std::size_t e = 0; e < nodes.elements.size(); ++e) to_offsets_[e + 1] += to_offsets_[e];
  to_.resize(from_.size());
  std::vector<std::uint32_t> next(to_offsets_.begin(), to_offsets_.end() - 1);
  for (std::uint32_t n = 0; n < nodes.size(); ++n)
    for (std::uint32_t i = from_offsets_[n]; i < from_offsets_[n + 1]; ++i) to_[next[from_[i]]++] = n;
}

// P^T K P over the elements that are nodes.
void QuadraticMultigrid::make_coarse(const Body& body, const std::vector<Vec3>& displacement,
                                     const CellStiffness& cells) {
  const QuadraticNodes& nodes = matrix_.nodes();
  std::array<std::size_t, 8> corner{};
  for (std::size_t a = 0; a < 8; ++a) corner[a] = node_of_corner(a);
  const CellCouplings none({}, nodes.cells.size()),
      &couplings = matrix_.cells().couplings() != nullptr ? *matrix_.cells().couplings() : none;
  std::vector<std::vector<std::uint32_t>> rows(nodes.elements.size());
  for (const auto& cell : nodes.of_cell)
    for (const std::size_t a : corner)
      for (const std::size_t b : corner) rows[cell[a]].push_back(cell[b]);
  for (const auto& [first, second] : couplings.pairs)
    for (const std::size_t a : corner)
      for (const std::size_t b : corner) {
        rows[nodes.of_cell[first][a]].push_back(nodes.of_cell[second][b]);
        rows[nodes.of_cell[second][b]].push_back(nodes.of_cell[first][a]);
      }
  coarse_.row_offsets.assign(1, 0);
  for (std::vector<std::uint32_t>& row : rows) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    coarse_.columns.insert(coarse_.columns.end(), row.begin(), row.end());
    coarse_.row_offsets.push_back(coarse_.columns.size());
  }
  coarse_.values.assign(coarse_.columns.size(), Block::Zero());
  for (std::size_t c = 0; c < nodes.cells.size(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b)
        coarse_.values[position_of(coarse_, nodes.of_cell[c][corner[a]], nodes.of_cell[c][corner[b]])] +=
            cells.corner_block(c, a, b);
  for (std::size_t p = 0; p < couplings.pairs.size(); ++p) {
    const CornerMatrix cross = corners_of(couplings.cross[p]);
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b) {
        const Mat3 block =
            cross.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
        const std::uint32_t first = nodes.of_cell[couplings.pairs[p][0]][corner[a]],
                            second = nodes.of_cell[couplings.pairs[p][1]][corner[b]];
        coarse_.values[position_of(coarse_, first, second)] += block;
        coarse_.values[position_of(coarse_, second, first)] += block.transpose();
      }
  }
  Constraints held;
  held.mask.assign(matrix_.held().begin(), matrix_.held().begin() + static_cast<std::ptrdiff_t>(rows.size()));
  eliminate(held, coarse_);
  const std::vector<std::uint32_t> part = element_parts(body);
  for (std::size_t n = 0; n < nodes.elements.size(); ++n) {
    const std::uint32_t e = nodes.elements[n];
    geometry_.position.push_back(displacement.empty() ? body.rest[e] : Vec3(body.rest[e] + displacement[n]));
    geometry_.index.push_back(body.lattice_index[e]);
    geometry_.part.push_back(part[e]);
  }
}

void QuadraticMultigrid::make_blocks(const CellStiffness& cells, const std::vector<BondedCells>& bonds) {
  const QuadraticNodes& nodes = matrix_.nodes();
  bond_blocks_ = BondBlocks(matrix_, bonds, [&](std::size_t cell, std::size_t a, std::size_t b) {
    return cells.block(cell, a, b);
  });
  block_of_.assign(nodes.cells.size(), -1);
  for (std::uint32_t c = 0; c < nodes.cells.size(); ++c) {
    if (bond_blocks_.has(c) || (cells_.fill(c) >= kFullEnough && !cells_.is_supported(c))) continue;
    block_of_[c] = static_cast<std::int32_t>(block_cells_.size());
    block_cells_.push_back(c);
  }
  weight_.assign(nodes.size(), 0);
  inverse_.assign(nodes.size(), Block::Zero());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const auto count = std::count_if(nodes.at(n).begin(), nodes.at(n).end(),
                                     [&](const auto& at) { return block_of_[at.cell] >= 0; }) +
                       static_cast<std::ptrdiff_t>(bond_blocks_.count(n));
    if (count > 0) {
      weight_[n] = 1 / std::sqrt(static_cast<double>(count));
      continue;
    }
    Block diagonal = Block::Zero();
    for (const QuadraticNodes::Incidence& at : nodes.at(n))
      diagonal += cells.block(at.cell, at.node, at.node);
    for (int axis = 0; axis < 3; ++axis)
      if (matrix_.held()[n] >> axis & 1) {
        diagonal.row(axis).setZero();
        diagonal.col(axis).setZero();
        diagonal(axis, axis) = 1;
      }
    inverse_[n] = diagonal.inverse();
  }
  make_weights(cells);
  inverse_factors_.assign(block_cells_.size(), {});
  block_values_.assign(block_cells_.size() * quadratic_kernel::kPaddedUnknowns, 0);
  constexpr std::size_t kWidth = quadratic_kernel::kWidth;
  parallel_for_each((block_cells_.size() + kWidth - 1) / kWidth,
                    [&](std::size_t e) { factorise(kWidth * e, cells); }, 2);
}

// Beside bonds, whose blocks hold nodes of other cells too, by multiplicity.
void QuadraticMultigrid::make_weights(const CellStiffness& cells) {
  const QuadraticNodes& nodes = matrix_.nodes();
  // a support may leave a sliver less than nothing
  const auto stiffness = [&](std::uint32_t cell, std::size_t node) {
    const float* block = cells.lower_block(cell, node, node);
    return std::max(static_cast<double>(block[0] + block[4] + block[8]), 0.0);
  };
  std::vector<double> sum(nodes.size(), 0);
  for (const std::uint32_t c : block_cells_)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) sum[nodes.of_cell[c][n]] += stiffness(c, n);
  block_weight_.resize(block_cells_.size() * kQuadraticNodes);
  for (std::size_t b = 0; b < block_cells_.size(); ++b)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      const std::uint32_t node = nodes.of_cell[block_cells_[b]][n];
      const bool shared = bond_blocks_.count(node) == 0 && sum[node] > 0;
      block_weight_[b * kQuadraticNodes + n] =
          static_cast<float>(shared ? std::sqrt(stiffness(block_cells_[b], n) / sum[node]) : weight_[node]);
    }
}

// The inverses of the Cholesky factors of the assembled stiffness of the nodes of eight cells: with T = L^-1, T^T T is its
// inverse, and positive however T is rounded.
void QuadraticMultigrid::factorise(std::size_t first, const CellStiffness& cells) {
  constexpr std::size_t kWidth = quadratic_kernel::kWidth;
  const std::size_t count = std::min(kWidth, block_cells_.size() - first);
  thread_local std::vector<double> matrices;
  matrices.assign(quadratic_kernel::kFactorSize * kWidth, 0);
  BlockTriangle sum;
  for (std::size_t lane = 0; lane < count; ++lane) {
    cells.assemble(matrix_.nodes(), matrix_.held(), block_cells_[first + lane], sum);
    for (std::size_t i = 0; i < sum.size(); ++i) matrices[kWidth * i + lane] = sum[i];
  }
  const unsigned failed = quadratic_kernel::best_matrices().invert_factors(matrices.data(), kRaised, count,
                                                                           &inverse_factors_[first]);
  for (std::size_t lane = 0; lane < count; ++lane)
    if ((failed >> lane & 1) != 0) {
      cells.assemble(matrix_.nodes(), matrix_.held(), block_cells_[first + lane], sum);
      factorise_raised(sum, inverse_factors_[first + lane]);
    }
}

// Where rounding left a block that is not positive: raised until it is.
void QuadraticMultigrid::factorise_raised(const BlockTriangle& sum, quadratic_kernel::Triangle& to) {
  constexpr double kMostRaised = 10;
  for (double raised = 1e-4; raised < kMostRaised; raised *= 10) {
    std::vector<double> matrix(quadratic_kernel::kFactorSize * quadratic_kernel::kWidth, 0);
    for (std::size_t i = 0; i < sum.size(); ++i) matrix[quadratic_kernel::kWidth * i] = sum[i];
    if (quadratic_kernel::best_matrices().invert_factors(matrix.data(), raised, 1, &to) % 2 == 0) return;
  }
  // by the diagonal alone
  std::size_t place = 0;
  for (std::size_t r = 0; r < quadratic_kernel::kUnknowns; ++r) {
    to.scale[r] = static_cast<float>(
        1 / std::sqrt(std::max(std::abs(sum[quadratic_kernel::row_place(r) + r]), 1e-300)));
    to.step[r] = 1.F / quadratic_kernel::kMostSteps;
    to.steps[place + r] = quadratic_kernel::kMostSteps;
    place += quadratic_kernel::group_columns(r / quadratic_kernel::kRows);
  }
}

void QuadraticMultigrid::multiply_roughly(const Vector& x, Vector& y) const {
  y.resize(x.size());
  cells_.forces(x[0].data(), y[0].data());
  matrix_.clear_held(y);
}

void QuadraticMultigrid::smooth_once(const Vector& residual, Vector& correction) const {
  const QuadraticNodes& nodes = matrix_.nodes();
  using quadratic_kernel::kPaddedUnknowns;
  parallel_for_each(
      block_cells_.size(),
      [&](std::size_t b) {
        alignas(64) float wanted[kPaddedUnknowns] = {};
        const auto& own = nodes.of_cell[block_cells_[b]];
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          for (std::size_t axis = 0; axis < 3; ++axis)
            wanted[3 * n + axis] = static_cast<float>(block_weight_[b * kQuadraticNodes + n] *
                                                      residual[own[n]][static_cast<Eigen::Index>(axis)]);
        quadratic_kernel::best().square(inverse_factors_[b], wanted, &block_values_[b * kPaddedUnknowns]);
      },
      kBlocksAtATime);
  bond_blocks_.solve(weight_, residual);
  correction.resize(residual.size());
  parallel_for_each(nodes.size(), [&](std::size_t n) {
    if (weight_[n] == 0) {
      correction[n] = inverse_[n] * residual[n];
      return;
    }
    Vec3 sum = bond_blocks_.count(n) > 0 ? Vec3(weight_[n] * bond_blocks_.sum(n)) : Vec3(Vec3::Zero());
    for (const QuadraticNodes::Incidence& at : nodes.at(n)) {
      if (block_of_[at.cell] < 0) continue;
      const auto block = static_cast<std::size_t>(block_of_[at.cell]);
      sum += (block_weight_[block * kQuadraticNodes + at.node] *
              Eigen::Map<const Eigen::Vector3f>(&block_values_[block * kPaddedUnknowns + 3 * at.node]))
                 .cast<double>();
    }
    correction[n] = sum;
  });
  matrix_.clear_held(correction);
}

// Of the tridiagonal matrix that conjugate gradients make of M^-1 A (Lanczos 1950): a few slivers may have the largest
// eigenvalue, which the power method shows only once the rest has fallen behind.
void QuadraticMultigrid::estimate_largest() {
  constexpr double kSettled = 1.005;  // from step to step
  std::mt19937 random(1);
  Vector residual(matrix_.nodes().size()), direction, image, smoothed;
  for (Vec3& each : residual)
    for (double& value : each) value = static_cast<double>(random()) / 4294967295.0 - 0.5;
  matrix_.clear_held(residual);
  smooth_once(residual, smoothed);
  direction = smoothed;
  std::vector<double> diagonal, beside;
  double squared = dot(residual, smoothed), before = 0,
         turned = 0;  // turned: what the last step left for the next diagonal
  for (std::size_t step = 0; squared > 0 && step < kMostLanczosSteps; ++step) {
    multiply_roughly(direction, image);
    const double length = squared / dot(direction, image);
    if (!(length > 0)) return widen();  // not positive: the estimate is no bound
    diagonal.push_back(1 / length + turned);
    before = largest_;
    largest_ = greatest_eigenvalue(diagonal, beside);
    if (step >= kLanczosSteps && largest_ < kSettled * before) return;
    parallel_for_each(residual.size(), [&](std::size_t n) { residual[n] -= length * image[n]; });
    smooth_once(residual, smoothed);
    const double next = dot(residual, smoothed), ratio = next / squared;
    beside.push_back(std::sqrt(ratio) / length);
    turned = ratio / length;
    squared = next;
    parallel_for_each(residual.size(),
                      [&](std::size_t n) { direction[n] = smoothed[n] + ratio * direction[n]; });
  }
  if (diagonal.size() == kMostLanczosSteps) widen();  // what is left of the growth is not known
}

// kSteps of Chebyshev's iteration on [largest / kRange, kMargin largest].
void QuadraticMultigrid::chebyshev(const Vector& b, Vector& x, bool from_zero) const {
  const double high = kMargin * largest_, low = high / kRange, middle = 0.5 * (high + low),
               half = 0.5 * (high - low);
  double rho = half / middle;
  Vector residual = b, image, smoothed;
  if (!from_zero) {
    multiply_roughly(x, image);
    parallel_for_each(b.size(), [&](std::size_t n) { residual[n] -= image[n]; });
  }
  smooth_once(residual, smoothed);
  Vector step = smoothed;
  parallel_for_each(step.size(), [&](std::size_t n) { step[n] /= middle; });
  for (int i = 0;; ++i) {
    parallel_for_each(x.size(), [&](std::size_t n) { x[n] += step[n]; });
    if (i + 1 == kSteps) return;
    multiply_roughly(step, image);
    parallel_for_each(x.size(), [&](std::size_t n) { residual[n] -= image[n]; });
    smooth_once(residual, smoothed);
    const double next = 1 / (2 * middle / half - rho);
    parallel_for_each(x.size(),
                      [&](std::size_t n) { step[n] = next * rho * step[n] + 2 * next / half * smoothed[n]; });
    rho = next;
  }
}

void QuadraticMultigrid::add_coarse_correction(const Vector& b, Vector& x) const {
  Vector residual;
  multiply_roughly(x, residual);
  parallel_for_each(b.size(), [&](std::size_t n) { residual[n] = b[n] - residual[n]; });
  matrix_.clear_held(residual);
  const std::size_t elements = matrix_.nodes().elements.size();
  Vector restricted(elements), correction;
  const auto count = [&](std::size_t n) {
    return static_cast<double>(from_offsets_[n + 1] - from_offsets_[n]);
  };
  parallel_for_each(elements, [&](std::size_t e) {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = to_offsets_[e]; i < to_offsets_[e + 1]; ++i)
      sum += residual[to_[i]] / count(to_[i]);
    restricted[e] = sum;
  });
  for (std::size_t e = 0; e < elements; ++e)
    for (int axis = 0; axis < 3; ++axis)
      if (matrix_.held()[e] >> axis & 1) restricted[e][axis] = 0;
  hierarchy_->apply(restricted, correction);
  Vector added(x.size());
  parallel_for_each(x.size(), [&](std::size_t n) {
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t i = from_offsets_[n]; i < from_offsets_[n + 1]; ++i) sum += correction[from_[i]];
    added[n] = sum / count(n);
  });
  matrix_.clear_held(added);
  parallel_for_each(x.size(), [&](std::size_t n) { x[n] += added[n]; });
}

void QuadraticMultigrid::apply(const Vector& residual, Vector& correction) const {
  correction.assign(residual.size(), Vec3::Zero());
  chebyshev(residual, correction, true);
  add_coarse_correction(residual, correction);
  chebyshev(residual, correction, false);
}

}  // namespace flexel::simulate
