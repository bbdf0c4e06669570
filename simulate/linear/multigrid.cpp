// Smoothed aggregation (Vanek, Mandel, Brezina 1996) with the six rigid motions of each aggregate. Level 0 is
// the tangent over the elements; every coarser level stands for groups of the level below: blocks of 3x3x3
// elements first, then of 2x2x2 aggregates, split where they are not connected. A V-cycle smooths with a
// Chebyshev polynomial in block Jacobi before and after, and the coarsest level is factorised. What depends
// on the pattern alone (aggregates, patterns of the transfers and of the coarse matrices) is made once;
// refresh() fills in values.
//
// Precision: vectors and every sum are in double precision. The coarse matrices, which only smooth, and the
// prolongators are kept in single precision: the Galerkin products are formed from the double precision
// values before they are rounded.
#include <array>
#include <cassert>
#include <optional>

#include "base/math/eigenvalues.h"
#include "base/program/share_scope.h"
#include "simulate/linear/direct.h"
#include "simulate/linear/level.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/preconditioner.h"
#include "simulate/linear/rigid_transfer.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kCoarsestRows = 500;  // aggregates of six unknowns
constexpr double kStrongLink = .01;         // weaker couplings do not hold an aggregate together
constexpr double kAnyLink = 1e-12;          // weaker couplings are rounding

using CoarseBlock = Eigen::Matrix<float, 6, 6>;

template <class BlockType>
MatrixView<BlockType> view(const Pattern& pattern, const std::vector<BlockType>& values) {
  return {pattern.offsets, pattern.columns, values};
}

Grouping grouping(const LevelNodes& fine, const Aggregates& aggregates) {
  Grouping result{
      aggregates.of, std::vector<Vec3>(fine.index.size(), Vec3::Zero()), {}, aggregates.nodes.reach};
  for (std::size_t i = 0; i < fine.index.size(); ++i) {
    const std::uint32_t a = aggregates.of[i];
    if (a != kNoAggregate) result.offset[i] = fine.position[i] - aggregates.nodes.position[a];
  }
  result.fine_reach.assign(fine.reach.begin(), fine.reach.end());
  return result;
}

// The projectors of those rows that a support holds, ascending. The sum of a row's blocks is what moving
// everything together is resisted with. The level's work vectors are overwritten.
std::vector<std::pair<std::uint32_t, Mat3>> restraints(const LinearOperator& matrix,
                                                       const std::vector<Block>& diagonal, Level<3>& level) {
  constexpr std::size_t kGrain = 4096;
  const std::size_t n = matrix.rows();
  std::vector<Eigen::Matrix3f> sum(n);
  for (int axis = 0; axis < 3; ++axis) {
    parallel_for_each(3 * n, [&](std::size_t k) { level.next[k] = static_cast<int>(k % 3) == axis; });
    matrix.multiply(level.next.data(), level.image.data());
    parallel_for_each(
        n, [&](std::size_t i) { sum[i].col(axis) = entry<3>(level.image.data(), i).cast<float>(); });
  }
  std::vector<std::vector<std::pair<std::uint32_t, Mat3>>> found((n + kGrain - 1) / kGrain);
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Mat3 free = free_directions(sum[i].cast<double>(), diagonal[i]);
      if (free != Mat3::Identity()) found[begin / kGrain].emplace_back(static_cast<std::uint32_t>(i), free);
    }
  });
  std::vector<std::pair<std::uint32_t, Mat3>> result;
  for (const auto& chunk : found) result.insert(result.end(), chunk.begin(), chunk.end());
  return result;
}

// Returns the diagonal blocks.
std::vector<Block> make_smoother(const LinearOperator& matrix, Level<3>& level, Estimate estimate) {
  std::vector<Block> diagonal = matrix.diagonal();
  prepare_smoother<3>(
      diagonal, [&](const double* x, double* y) { matrix.multiply(x, y); }, level, estimate);
  return diagonal;
}

// Values of the prolongator, for the coarse matrix alone: the cycle applies it as RigidTransfer says.
void refresh_transfer(const LinearOperator& matrix, RigidTransfer& rigid, Level<3>& level) {
  rigid.restrain(restraints(matrix, make_smoother(matrix, level, Estimate::anew), level));
  smooth_prolongator<3>(
      OperatorView(matrix), level.inverse_diagonal, smoothing_weight(level.largest_eigenvalue),
      rigid.aggregate_of(), [&](std::size_t i) { return rigid.at(i); }, level.transfer);
}

void refresh_transfer(const MatrixView<Square<6>>& matrix, const Grouping& groups, Level<6>& level) {
  std::vector<Square<6>> diagonal(matrix.rows());
  parallel_for_each(diagonal.size(), [&](std::size_t i) {
    const auto begin = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.offsets[i]);
    const auto end = matrix.columns.begin() + static_cast<std::ptrdiff_t>(matrix.offsets[i + 1]);
    diagonal[i] =
        matrix.values[static_cast<std::size_t>(std::lower_bound(begin, end, i) - matrix.columns.begin())];
  });
  const auto multiply = [&](const double* x, double* y) {
    for_each_product<6>(matrix, x, nullptr,
                        [&](std::size_t i, const auto& product) { entry<6>(y, i) = product; });
  };
  prepare_smoother<6>(diagonal, multiply, level);
  const auto tentative = [&](std::size_t i) {
    return rigid_motion<6>(groups.offset[i], groups.fine_reach[i],
                           groups.coarse_reach[groups.aggregate_of[i]]);
  };
  smooth_prolongator<6>(matrix, level.inverse_diagonal, smoothing_weight(level.largest_eigenvalue),
                        groups.aggregate_of, tentative, level.transfer);
}

struct CoarseLevel {
  Pattern pattern;
  std::vector<CoarseBlock> values;
  Grouping groups;
  Level<6> level;
};

class Multigrid : public Preconditioner {
 public:
  Multigrid(const LinearOperator& matrix, const NodeGeometry& geometry, const DirectLimit& direct)
      : matrix_(matrix) {
    assert(geometry.position.size() == matrix.rows() && geometry.index.size() == matrix.rows());
    const double cheap = direct.row_cost * static_cast<double>(matrix.rows());
    if (matrix.rows() > direct.rows && !(cheap > 0 && factor_takes_at_most(matrix, cheap)))
      build_structure(geometry);
    tell_share(kStructured);
    refresh();
  }

  void apply(const std::vector<Vec3>& residual, std::vector<Vec3>& correction) const override {
    correction.resize(matrix_.rows());
    if (residual.empty()) return;
    if (coarse_.empty()) {
      correction = residual;
      coarsest_.solve(correction.front().data());
      return;
    }
    const double* b = residual.front().data();
    double* x = correction.front().data();
    double* work = fine_.next.data();
    const LinearOperator& fine = matrix_;
    smooth_from_zero<3>(fine, fine_, b, x, work);
    restrict_elements(b, x);
    cycle(0);
    prolong_elements(x);
    smooth<3>(fine, fine_, b, x, work);
  }

  // The hierarchy stays positive definite: it is for any coarse matrix that is, as long as the smoother
  // converges.
  void refresh_smoother() override {
    if (coarse_.empty())
      refresh();
    else
      (void)make_smoother(matrix_, fine_, Estimate::onwards);
  }

  void refresh() override {
    if (matrix_.rows() == 0) return;
    if (coarse_.empty()) return factorise_at_once();
    refresh_transfer(matrix_, *rigid_, fine_);
    tell_share(kSmoothed);
    std::vector<Square<6>> values =
        galerkin<3>(OperatorView(matrix_), fine_.transfer, coarse_.front().pattern);
    tell_share(kMultiplied);
    fine_.transfer.values = {};
    for (std::size_t l = 0; l < coarse_.size(); ++l) {
      CoarseLevel& coarse = coarse_[l];
      const auto exact = view(coarse.pattern, values);
      if (l + 1 == coarse_.size()) {
        coarsest_.factorise(lower_half(exact));
        break;
      }
      refresh_transfer(exact, coarse.groups, coarse.level);
      std::vector<Square<6>> next = galerkin<6>(exact, coarse.level.transfer, coarse_[l + 1].pattern);
      coarse.values.resize(values.size());
      parallel_for_each(values.size(), [&](std::size_t q) { coarse.values[q] = values[q].cast<float>(); });
      values = std::move(next);
    }
  }

 private:
  // Shares of the time that making it takes: patterns, the finest level's transfer, the first coarse matrix.
  static constexpr double kStructured = 0.15, kSmoothed = 0.4, kMultiplied = 0.85;

  void factorise_at_once() {
    std::vector<Block> room;
    const Block* blocks = matrix_.blocks(0, matrix_.rows(), room);
    coarsest_.factorise(lower_half(MatrixView<Block>{matrix_.row_offsets(), matrix_.columns(),
                                                     std::span(blocks, matrix_.columns().size())}));
  }

  // Aggregates and patterns of every level.
  void build_structure(const NodeGeometry& geometry) {
    LevelNodes nodes{geometry.index, geometry.part, geometry.position,
                     std::vector<double>(matrix_.rows(), 0)};
    const OperatorView fine(matrix_);
    Aggregates aggregates;
    {
      const std::vector<std::uint8_t> strength = link_strengths(matrix_, std::array{kAnyLink, kStrongLink});
      aggregates = aggregate(nodes, {fine.offsets, fine.columns, strength, 1},
                             {fine.offsets, fine.columns, strength, 2},
                             {.width = 3, .smallest = 4, .drop_isolated = true});
    }
    rigid_.emplace(grouping(nodes, aggregates));
    fine_.transfer = transfer_pattern<3>(fine, aggregates.of, aggregates.count());
    fine_.next.resize(3 * matrix_.rows());
    fine_.image.resize(3 * matrix_.rows());
    fine_.scaled.resize(3 * matrix_.rows());
    coarse_.emplace_back().pattern = coarse_pattern<3>(fine, fine_.transfer);
    while (aggregates.count() > kCoarsestRows) {
      nodes = std::move(aggregates.nodes);
      const Graph links = std::move(aggregates.links);
      aggregates =
          aggregate(nodes, links.links(), links.links(), {.width = 2, .smallest = 2, .drop_isolated = false});
      if (aggregates.count() > nodes.index.size() * 4 / 5) break;  // nothing left to group: many small parts
      CoarseLevel& last = coarse_.back();
      last.groups = grouping(nodes, aggregates);
      const auto structure = view(last.pattern, last.values);
      last.level.transfer = transfer_pattern<6>(structure, aggregates.of, aggregates.count());
      Pattern next = coarse_pattern<6>(structure, last.level.transfer);
      coarse_.emplace_back().pattern = std::move(next);
    }
    for (CoarseLevel& coarse : coarse_) {
      const std::size_t size = 6 * (coarse.pattern.offsets.size() - 1);
      coarse.level.rhs.resize(size);
      coarse.level.x.resize(size);
      coarse.level.next.resize(size);
    }
  }

  // The right-hand side of the first coarser level: P^T (b - A x) = T^T (r - w A D^-1 r).
  void restrict_elements(const double* b, const double* x) const {
    const double weight = smoothing_weight(fine_.largest_eigenvalue);
    double *residual = fine_.next.data(), *scaled = fine_.scaled.data(), *image = fine_.image.data();
    for_each_product<3>(matrix_, x, image, [&](std::size_t i, const auto& product) {
      const Vec3 left = entry<3>(b, i) - product;
      entry<3>(residual, i) = left;
      entry<3>(scaled, i) = times<3>(fine_.inverse_diagonal[i], left);
    });
    matrix_.multiply(scaled, image);
    rigid_->collect(
        [&](std::size_t i) -> Vec3 {
          return entry<3>(static_cast<const double*>(residual), i) -
                 weight * entry<3>(static_cast<const double*>(image), i);
        },
        coarse_.front().level.rhs.data());
  }

  // x += P c, c the answer of the first coarser level: e = T c, x += e - w D^-1 A e.
  void prolong_elements(double* x) const {
    const double weight = smoothing_weight(fine_.largest_eigenvalue);
    double* moved = fine_.next.data();
    rigid_->spread(coarse_.front().level.x.data(), moved);
    for_each_product<3>(matrix_, moved, fine_.image.data(), [&](std::size_t i, const auto& product) {
      const Vec3 force = weight * product;
      entry<3>(x, i) += entry<3>(moved, i) - times<3>(fine_.inverse_diagonal[i], force);
    });
  }

  // Solves level l approximately: from its rhs to its x.
  void cycle(std::size_t l) const {
    const CoarseLevel& coarse = coarse_[l];
    const Level<6>& level = coarse.level;
    if (l + 1 == coarse_.size()) {
      level.x = level.rhs;
      return coarsest_.solve(level.x.data());
    }
    const auto matrix = view(coarse.pattern, coarse.values);
    smooth_from_zero<6>(matrix, level, level.rhs.data(), level.x.data(), level.next.data());
    restrict_residual(matrix, level, level.rhs.data(), level.x.data(), level.next.data(),
                      coarse_[l + 1].level.rhs.data());
    cycle(l + 1);
    prolong(level, coarse_[l + 1].level.x.data(), level.x.data());
    smooth<6>(matrix, level, level.rhs.data(), level.x.data(), level.next.data());
  }

  const LinearOperator& matrix_;
  std::optional<RigidTransfer> rigid_;  // nothing where the matrix itself is factorised
  Level<3> fine_;
  std::vector<CoarseLevel> coarse_;  // empty where the matrix itself is factorised
  DirectSolver coarsest_;
};

}  // namespace

std::unique_ptr<Preconditioner> aggregation_multigrid(const LinearOperator& matrix,
                                                      const NodeGeometry& geometry,
                                                      const DirectLimit& direct) {
  return std::make_unique<Multigrid>(matrix, geometry, direct);
}

namespace {

// With the operator that it needs.
class MultigridOfStored : public Preconditioner {
 public:
  MultigridOfStored(const BlockMatrix& matrix, const NodeGeometry& geometry, const DirectLimit& direct)
      : operator_(matrix), multigrid_(operator_, geometry, direct) {}
  void apply(const std::vector<Vec3>& residual, std::vector<Vec3>& correction) const override {
    multigrid_.apply(residual, correction);
  }
  void refresh() override { multigrid_.refresh(); }
  void refresh_smoother() override { multigrid_.refresh_smoother(); }

 private:
  StoredMatrix operator_;
  Multigrid multigrid_;
};

}  // namespace

std::unique_ptr<Preconditioner> aggregation_multigrid(const BlockMatrix& matrix, const NodeGeometry& geometry,
                                                      const DirectLimit& direct) {
  return std::make_unique<MultigridOfStored>(matrix, geometry, direct);
}

}  // namespace flexel::simulate
