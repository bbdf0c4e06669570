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

#include "simulate/linear/direct.h"
#include "simulate/linear/level.h"
#include "simulate/linear/solve.h"

namespace flexel {
namespace {

constexpr std::size_t kDirectRows = 1000;   // elements; a matrix up to this size is factorised at once
constexpr std::size_t kCoarsestRows = 500;  // aggregates of six unknowns
constexpr double kStrongLink = .01;         // weaker couplings do not hold an aggregate together
constexpr double kAnyLink = 1e-12;          // weaker couplings are rounding

using CoarseBlock = Eigen::Matrix<float, 6, 6>;

template <class BlockType>
MatrixView<BlockType> view(const Pattern& pattern, const std::vector<BlockType>& values) {
  return {pattern.offsets, pattern.columns, values};
}

// Weight of the step that smooths the prolongator; the estimate is from below, hence 1.05.
double smoothing_weight(double largest_eigenvalue) {
  return 4. / 3 / (1.05 * largest_eigenvalue);
}

// What a level's prolongator is made from, besides the matrix.
struct Grouping {
  std::vector<std::uint32_t> aggregate_of;  // (rows)
  std::vector<Vec3> offset;                 // (rows x 3) m, from the aggregate's centre
  std::vector<float> fine_reach;            // (rows); empty for elements
  std::vector<double> coarse_reach;         // (aggregates)
};

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

// Directions in which a support holds element i directly: moving i and its neighbours together along such a
// direction is resisted nearly as much as moving i alone (elastic links do not resist that at all). Returns
// the projector on the other directions. A coarse motion must leave held elements alone: one that drags them
// against a penalty of hundreds of E / h would cost so much that the free elements of the same aggregate
// would get no coarse motion either.
// `sum`: of the blocks of its row, `own`: the diagonal one.
Mat3 free_directions(const Mat3& sum, const Mat3& own) {
  constexpr double kHeld = .5;
  if (sum.norm() < .1 * own.norm()) return Mat3::Identity();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(.5 * (sum + sum.transpose()));
  Mat3 projector = Mat3::Identity();
  for (int c = 0; c < 3; ++c) {
    const Vec3 direction = eigen.eigenvectors().col(c);
    if (eigen.eigenvalues()[c] > kHeld * direction.dot(own * direction))
      projector -= direction * direction.transpose();
  }
  return projector;
}

// The projectors of all rows. The sum of a row's blocks is what moving everything together is resisted with.
std::vector<Eigen::Matrix3f> free_directions(const LinearOperator& matrix,
                                             const std::vector<Block>& diagonal) {
  const std::size_t n = matrix.rows();
  std::vector<Eigen::Matrix3f> free(n);
  std::vector<double> together(3 * n), force(3 * n);
  for (int axis = 0; axis < 3; ++axis) {
    parallel_for_each(3 * n, [&](std::size_t k) { together[k] = static_cast<int>(k % 3) == axis; });
    matrix.multiply(together.data(), force.data());
    parallel_for_each(n, [&](std::size_t i) { free[i].col(axis) = entry<3>(force.data(), i).cast<float>(); });
  }
  parallel_for_each(n, [&](std::size_t i) {
    free[i] = free_directions(free[i].cast<double>(), diagonal[i]).cast<float>();
  });
  return free;
}

// Returns the diagonal blocks.
std::vector<Block> make_smoother(const LinearOperator& matrix, Level<3>& level) {
  std::vector<Block> diagonal = matrix.diagonal();
  prepare_smoother<3>(
      diagonal, [&](const double* x, double* y) { matrix.multiply(x, y); }, level);
  return diagonal;
}

void refresh_transfer(const LinearOperator& matrix, const Grouping& groups, Level<3>& level) {
  const std::vector<Block> diagonal = make_smoother(matrix, level);
  const std::vector<Eigen::Matrix3f> free = free_directions(matrix, diagonal);
  const auto tentative = [&](std::size_t i) -> Eigen::Matrix<double, 6, 3> {
    const double reach = groups.coarse_reach[groups.aggregate_of[i]];
    return rigid_motion<3>(groups.offset[i], 0, reach) * free[i].cast<double>();
  };
  smooth_prolongator<3>(OperatorView(matrix), level.inverse_diagonal,
                        smoothing_weight(level.largest_eigenvalue), groups.aggregate_of, tentative,
                        level.transfer);
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
  Multigrid(const LinearOperator& matrix, const NodeGeometry& geometry) : matrix_(matrix) {
    assert(geometry.position.size() == matrix.rows() && geometry.index.size() == matrix.rows());
    if (matrix.rows() > kDirectRows) build_structure(geometry);
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
    restrict_residual<3>(fine, fine_, b, x, work, coarse_.front().level.rhs.data());
    cycle(0);
    prolong<3>(fine_, coarse_.front().level.x.data(), x);
    smooth<3>(fine, fine_, b, x, work);
  }

  // The hierarchy stays positive definite: it is for any coarse matrix that is, as long as the smoother
  // converges.
  void refresh_smoother() override {
    if (coarse_.empty())
      refresh();
    else
      (void)make_smoother(matrix_, fine_);
  }

  void refresh() override {
    if (matrix_.rows() == 0) return;
    if (coarse_.empty()) return factorise_at_once();
    refresh_transfer(matrix_, groups_, fine_);
    std::vector<Square<6>> values =
        galerkin<3>(OperatorView(matrix_), fine_.transfer, coarse_.front().pattern);
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
      for (std::size_t q = 0; q < values.size(); ++q) coarse.values[q] = values[q].cast<float>();
      values = std::move(next);
    }
  }

 private:
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
    const std::vector<Graph> graphs = coupled_rows(matrix_, std::array{kAnyLink, kStrongLink});
    Aggregates aggregates =
        aggregate(nodes, graphs[0], graphs[1], {.width = 3, .smallest = 4, .drop_isolated = true});
    groups_ = grouping(nodes, aggregates);
    fine_.transfer = transfer_pattern<3>(fine, aggregates.of, aggregates.count());
    fine_.next.resize(3 * matrix_.rows());
    fine_.image.resize(3 * matrix_.rows());
    coarse_.emplace_back().pattern = coarse_pattern<3>(fine, fine_.transfer);
    while (aggregates.count() > kCoarsestRows) {
      nodes = std::move(aggregates.nodes);
      const Graph links = std::move(aggregates.links);
      aggregates = aggregate(nodes, links, links, {.width = 2, .smallest = 2, .drop_isolated = false});
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
    restrict_residual<6>(matrix, level, level.rhs.data(), level.x.data(), level.next.data(),
                         coarse_[l + 1].level.rhs.data());
    cycle(l + 1);
    prolong<6>(level, coarse_[l + 1].level.x.data(), level.x.data());
    smooth<6>(matrix, level, level.rhs.data(), level.x.data(), level.next.data());
  }

  const LinearOperator& matrix_;
  Grouping groups_;
  Level<3> fine_;
  std::vector<CoarseLevel> coarse_;  // empty where the matrix itself is factorised
  DirectSolver coarsest_;
};

}  // namespace

std::unique_ptr<Preconditioner> aggregation_multigrid(const LinearOperator& matrix,
                                                      const NodeGeometry& geometry) {
  return std::make_unique<Multigrid>(matrix, geometry);
}

namespace {

// With the operator that it needs.
class MultigridOfStored : public Preconditioner {
 public:
  MultigridOfStored(const BlockMatrix& matrix, const NodeGeometry& geometry)
      : operator_(matrix), multigrid_(operator_, geometry) {}
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

std::unique_ptr<Preconditioner> aggregation_multigrid(const BlockMatrix& matrix,
                                                      const NodeGeometry& geometry) {
  return std::make_unique<MultigridOfStored>(matrix, geometry);
}

}  // namespace flexel
