// Prescribed components are 0 in every residual and correction.
#include "simulate/quadratic/quadratic_multigrid.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "base/parallel.h"
#include "simulate/conditions/constraints.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr int kSteps = 2;        // of Chebyshev's iteration, before and after
constexpr double kRange = 8;     // largest over smallest eigenvalue that it damps
constexpr double kMargin = 1.1;  // over the estimate of the largest
constexpr int kPowerSteps = 15;
constexpr double kRaised = 1e-6;  // of a block's scaled diagonal: it is kept in single precision
constexpr std::size_t kBlocksAtATime = 16;
using Vector = std::vector<Vec3>;

}  // namespace

QuadraticMultigrid::QuadraticMultigrid(const QuadraticOperator& matrix, const Body& body,
                                       const std::vector<Vec3>& displacement)
    : matrix_(matrix) {
  make_transfer();
  make_coarse(body, displacement);
  hierarchy_ = aggregation_multigrid(coarse_, geometry_);
  make_blocks();
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
void QuadraticMultigrid::make_coarse(const Body& body, const std::vector<Vec3>& displacement) {
  const QuadraticNodes& nodes = matrix_.nodes();
  std::array<std::size_t, 8> corner{};
  for (std::size_t a = 0; a < 8; ++a) corner[a] = node_of_corner(a);
  std::vector<std::vector<std::uint32_t>> rows(nodes.elements.size());
  for (const auto& cell : nodes.of_cell)
    for (const std::size_t a : corner)
      for (const std::size_t b : corner) rows[cell[a]].push_back(cell[b]);
  coarse_.row_offsets.assign(1, 0);
  for (std::vector<std::uint32_t>& row : rows) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    coarse_.columns.insert(coarse_.columns.end(), row.begin(), row.end());
    coarse_.row_offsets.push_back(coarse_.columns.size());
  }
  coarse_.values.assign(coarse_.columns.size(), Block::Zero());
  Eigen::Matrix<double, kCellUnknowns, 24> embed = Eigen::Matrix<double, kCellUnknowns, 24>::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (std::size_t a = 0; a < 8; ++a)
      embed.block<3, 3>(static_cast<Eigen::Index>(3 * n), static_cast<Eigen::Index>(3 * a)) =
          trilinear_weight(n, a) * Mat3::Identity();
  std::vector<Eigen::Matrix<double, 24, 24>> of_cell(nodes.cells.size());
  parallel_for_each(
      nodes.cells.size(),
      [&](std::size_t c) { of_cell[c].noalias() = embed.transpose() * (matrix_.matrix(c) * embed); },
      kBlocksAtATime);
  for (std::size_t c = 0; c < nodes.cells.size(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b)
        coarse_.values[position_of(coarse_, nodes.of_cell[c][corner[a]], nodes.of_cell[c][corner[b]])] +=
            of_cell[c].block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
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

void QuadraticMultigrid::make_blocks() {
  const QuadraticNodes& nodes = matrix_.nodes();
  for (std::uint32_t c = 0; c < nodes.cells.size(); ++c)
    if (matrix_.has_own(c)) block_cells_.push_back(c);
  blocks_at_.resize(nodes.size());
  for (std::uint32_t b = 0; b < block_cells_.size(); ++b)
    for (std::uint32_t n = 0; n < kQuadraticNodes; ++n)
      blocks_at_[nodes.of_cell[block_cells_[b]][n]].emplace_back(b, n);
  weight_.assign(nodes.size(), 0);
  inverse_.assign(nodes.size(), Block::Zero());
  std::vector<Block> diagonal = matrix_.diagonal();
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (!blocks_at_[n].empty()) {
      weight_[n] = 1 / std::sqrt(static_cast<double>(blocks_at_[n].size()));
      continue;
    }
    for (int axis = 0; axis < 3; ++axis)
      if (matrix_.held()[n] >> axis & 1) {
        diagonal[n].row(axis).setZero();
        diagonal[n].col(axis).setZero();
        diagonal[n](axis, axis) = 1;
      }
    inverse_[n] = diagonal[n].inverse();
  }
  factors_.assign(block_cells_.size() * kPackedSize, 0);
  block_values_.assign(block_cells_.size() * kCellUnknowns, 0);
  parallel_for_each(
      block_cells_.size(), [&](std::size_t b) { factorise(b, block_cells_[b]); }, kBlocksAtATime);
}

// Cholesky's factor of the assembled stiffness of a cell's nodes.
void QuadraticMultigrid::factorise(std::size_t block, std::uint32_t cell) {
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
        if (b <= a) sum.block<3, 3>(a, b) += matrix_.block(other, there_a, there_b);
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
  const CellMatrix lower = scale.asDiagonal() * CellMatrix(factor.matrixL());
  float* to = &factors_[block * kPackedSize];
  for (int i = 0; i < kCellUnknowns; ++i)
    for (int j = 0; j <= i; ++j) *to++ = static_cast<float>(lower(i, j));
}

void QuadraticMultigrid::smooth_once(const Vector& residual, Vector& correction) const {
  const QuadraticNodes& nodes = matrix_.nodes();
  using Values = Eigen::Matrix<float, kCellUnknowns, 1>;
  parallel_for_each(
      block_cells_.size(),
      [&](std::size_t b) {
        Eigen::Map<Values> x(&block_values_[b * kCellUnknowns]);
        const auto& own = nodes.of_cell[block_cells_[b]];
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          x.segment<3>(static_cast<Eigen::Index>(3 * n)) = (weight_[own[n]] * residual[own[n]]).cast<float>();
        const float* row = &factors_[b * kPackedSize];
        for (int i = 0; i < kCellUnknowns; ++i) {
          x[i] = (x[i] - Eigen::Map<const Eigen::VectorXf>(row, i).dot(x.head(i))) / row[i];
          row += i + 1;
        }
        for (int i = kCellUnknowns - 1; i >= 0; --i) {
          row -= i + 1;
          x[i] /= row[i];
          x.head(i) -= x[i] * Eigen::Map<const Eigen::VectorXf>(row, i);
        }
      },
      kBlocksAtATime);
  correction.resize(residual.size());
  parallel_for_each(nodes.size(), [&](std::size_t n) {
    if (blocks_at_[n].empty()) {
      correction[n] = inverse_[n] * residual[n];
      return;
    }
    Vec3 sum = Vec3::Zero();
    for (const auto& [block, node] : blocks_at_[n])
      sum +=
          Eigen::Map<const Eigen::Vector3f>(&block_values_[block * kCellUnknowns + 3 * node]).cast<double>();
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
  for (int step = 0; step < kPowerSteps; ++step) {
    const double norm = std::sqrt(dot(x, x));
    if (!(norm > 0)) return;
    parallel_for_each(x.size(), [&](std::size_t n) { x[n] /= norm; });
    multiply(matrix_, x, image);
    smooth_once(image, x);
    largest_ = std::sqrt(dot(x, x));
  }
}

// kSteps of Chebyshev's iteration on [largest / kRange, kMargin largest].
void QuadraticMultigrid::chebyshev(const Vector& b, Vector& x, bool from_zero) const {
  const double high = kMargin * largest_, low = high / kRange, middle = 0.5 * (high + low),
               half = 0.5 * (high - low);
  double rho = half / middle;
  Vector residual = b, image, smoothed;
  if (!from_zero) {
    multiply(matrix_, x, image);
    parallel_for_each(b.size(), [&](std::size_t n) { residual[n] -= image[n]; });
  }
  smooth_once(residual, smoothed);
  Vector step = smoothed;
  parallel_for_each(step.size(), [&](std::size_t n) { step[n] /= middle; });
  for (int i = 0;; ++i) {
    parallel_for_each(x.size(), [&](std::size_t n) { x[n] += step[n]; });
    if (i + 1 == kSteps) return;
    multiply(matrix_, step, image);
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
  multiply(matrix_, x, residual);
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
