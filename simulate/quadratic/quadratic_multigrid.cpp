// Prescribed components are 0 in every residual and correction.
#include "simulate/quadratic/quadratic_multigrid.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

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
constexpr int kPowerSteps = 15, kMostPowerSteps = 60;
constexpr double kRaised = 1e-6;  // of a block's scaled diagonal: what it is made from is in single precision
constexpr std::size_t kBlocksAtATime = 16;
using Vector = std::vector<Vec3>;
using CornerMatrix = Eigen::Matrix<double, 24, 24>;

// P^T K P, of a matrix of the nodes of two cells.
CornerMatrix corners_of(const CellMatrix& matrix) {
  Eigen::Matrix<double, kCellUnknowns, 24> embedding = Eigen::Matrix<double, kCellUnknowns, 24>::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (std::size_t a = 0; a < 8; ++a)
      embedding.block<3, 3>(static_cast<Eigen::Index>(3 * n), static_cast<Eigen::Index>(3 * a)) =
          trilinear_weight(n, a) * Mat3::Identity();
  return embedding.transpose() * matrix * embedding;
}

}  // namespace

// Of all cells, while the rest is made from it.
struct QuadraticMultigrid::CellStiffness {
  std::vector<CornerMatrix> corners;  // (cells) of the trilinear field
  std::vector<std::size_t> place;     // (cells) in `packed`: cells that have the same matrix share it
  std::vector<float> packed;          // (x kPackedSize) lower triangle, row by row

  CellStiffness(const CellProducts<double>& cells, std::size_t count) : corners(count), place(count) {
    std::vector<std::uint32_t> others;  // cells whose matrix is no other's
    const std::vector<std::uint32_t> twins = cells.twins();
    for (std::uint32_t c = 0; c < count; ++c)
      if (twins[c] == c) {
        place[c] = others.size();
        others.push_back(c);
      }
    packed.resize(others.size() * kPackedSize);
    parallel_for_each(
        others.size(),
        [&](std::size_t i) {
          corners[others[i]] = corner_matrix(cells, others[i]);
          const CellMatrix matrix = cells.matrix(others[i]);
          float* to = &packed[i * kPackedSize];
          for (int row = 0; row < kCellUnknowns; ++row)
            for (int j = 0; j <= row; ++j) *to++ = static_cast<float>(matrix(row, j));
        },
        kBlocksAtATime);
    for (std::size_t c = 0; c < count; ++c)
      if (const std::uint32_t same = twins[c]; same != c) {
        place[c] = place[same];
        corners[c] = corners[same];
      }
  }

  // P^T K P
  static CornerMatrix corner_matrix(const CellProducts<double>& cells, std::size_t cell) {
    CornerMatrix made = CornerMatrix::Zero();
    CellColumns embedded;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      embedded.setZero();
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        for (std::size_t a = 0; a < 8; ++a)
          embedded(static_cast<Eigen::Index>(3 * n + axis), static_cast<Eigen::Index>(a)) =
              trilinear_weight(n, a);
      const CellColumns forces = cells.multiply(cell, embedded);
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        for (std::size_t a = 0; a < 8; ++a)
          if (const double weight = trilinear_weight(n, a); weight > 0)
            for (std::size_t b = 0; b < 8; ++b)
              made.block<3, 1>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b + axis)) +=
                  weight * forces.block<3, 1>(static_cast<Eigen::Index>(3 * n), static_cast<Eigen::Index>(b));
    }
    return 0.5 * (made + made.transpose());
  }

  // Of two of a cell's nodes.
  [[nodiscard]] Mat3 block(std::size_t cell, std::size_t a, std::size_t b) const {
    const float* from = &packed[place[cell] * kPackedSize];
    Mat3 found;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t most = std::max(3 * a + i, 3 * b + j), least = std::min(3 * a + i, 3 * b + j);
        found(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            static_cast<double>(from[most * (most + 1) / 2 + least]);
      }
    return found;
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
  hierarchy_ = aggregation_multigrid(coarse_, geometry_);
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
            cells.corners[c].block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
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
  inverse_factors_.assign(block_cells_.size(), {});
  block_values_.assign(block_cells_.size() * quadratic_kernel::kPaddedUnknowns, 0);
  parallel_for_each(
      block_cells_.size(), [&](std::size_t b) { factorise(b, block_cells_[b], cells); }, kBlocksAtATime);
}

// The inverse of Cholesky's factor of the assembled stiffness of a cell's nodes: with T = L^-1, T^T T is its inverse, and
// positive however T is rounded.
void QuadraticMultigrid::factorise(std::size_t block, std::uint32_t cell, const CellStiffness& cells) {
  const QuadraticNodes& nodes = matrix_.nodes();
  const auto& own = nodes.of_cell[cell];
  std::vector<std::uint32_t> around;
  for (const std::uint32_t node : own)
    for (const QuadraticNodes::Incidence& at : nodes.at(node)) around.push_back(at.cell);
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  CellMatrix sum = CellMatrix::Zero();
  for (const std::uint32_t other : around) {
    std::vector<std::pair<Eigen::Index, std::size_t>> shared;  // row here, node there
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      if (const auto found = std::find(own.begin(), own.end(), nodes.of_cell[other][n]); found != own.end())
        shared.emplace_back(3 * (found - own.begin()), n);
    for (const auto& [a, there_a] : shared)
      for (const auto& [b, there_b] : shared)
        if (b <= a) sum.block<3, 3>(a, b) += cells.block(other, there_a, there_b);
  }
  sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (matrix_.held()[own[n]] >> axis & 1) {
        const auto i = static_cast<Eigen::Index>(3 * n + axis);
        sum.row(i).setZero();
        sum.col(i).setZero();
        sum(i, i) = 1;
      }
  const Eigen::Matrix<double, kCellUnknowns, 1> scale =
      sum.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt();
  const auto inverse = scale.cwiseInverse().asDiagonal();
  CellMatrix scaled = inverse * sum * inverse;
  scaled.diagonal().array() += kRaised;
  Eigen::LLT<CellMatrix> factor(scaled);
  for (double more = 1e-4; factor.info() != Eigen::Success && more < 10; more *= 10) {
    scaled.diagonal().array() += more;
    factor.compute(scaled);
  }
  CellMatrix lower = CellMatrix::Identity();
  if (factor.info() == Eigen::Success) factor.matrixL().solveInPlace(lower);  // else by the diagonal alone
  quadratic_kernel::Triangle& to = inverse_factors_[block];
  for (int i = 0; i < kCellUnknowns; ++i) to.scale[i] = static_cast<float>(1 / scale[i]);
  std::int16_t* steps = to.steps;
  for (std::size_t r = 0; r < static_cast<std::size_t>(kCellUnknowns); ++r) {
    const auto row = lower.row(static_cast<Eigen::Index>(r));
    const double step = row.cwiseAbs().maxCoeff() / quadratic_kernel::kMostSteps;
    to.step[r] = static_cast<float>(step);
    for (std::size_t j = 0; j <= r; ++j)
      steps[j] = static_cast<std::int16_t>(std::lround(row[static_cast<Eigen::Index>(j)] / step));
    steps += quadratic_kernel::group_columns(r / quadratic_kernel::kRows);
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
            wanted[3 * n + axis] =
                static_cast<float>(weight_[own[n]] * residual[own[n]][static_cast<Eigen::Index>(axis)]);
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
    Vec3 sum = bond_blocks_.count(n) > 0 ? bond_blocks_.sum(n) : Vec3(Vec3::Zero());
    for (const QuadraticNodes::Incidence& at : nodes.at(n))
      if (const std::int32_t block = block_of_[at.cell]; block >= 0)
        sum += Eigen::Map<const Eigen::Vector3f>(
                   &block_values_[static_cast<std::size_t>(block) * kPaddedUnknowns + 3 * at.node])
                   .cast<double>();
    correction[n] = weight_[n] * sum;
  });
  matrix_.clear_held(correction);
}

void QuadraticMultigrid::estimate_largest() {
  std::mt19937 random(1);
  Vector x(matrix_.nodes().size()), image;
  for (Vec3& each : x)
    for (double& value : each) value = static_cast<double>(random()) / 4294967295.0 - 0.5;
  matrix_.clear_held(x);
  // A few slivers may have the largest eigenvalue: it shows once the rest has fallen behind.
  constexpr double kSettled = 1.01;  // from step to step
  double before = 0;
  for (int step = 0; step < kMostPowerSteps && (step < kPowerSteps || largest_ > kSettled * before); ++step) {
    before = largest_;
    const double norm = std::sqrt(dot(x, x));
    if (!(norm > 0)) return;
    parallel_for_each(x.size(), [&](std::size_t n) { x[n] /= norm; });
    multiply_roughly(x, image);
    smooth_once(image, x);
    largest_ = std::sqrt(dot(x, x));
  }
  if (largest_ > kSettled * before) widen();  // what is left of the growth is not known
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
