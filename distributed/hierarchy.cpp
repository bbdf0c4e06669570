// Values of elements that several ranks have are the same on all of these: they are summed up where they are owned, and handed out again.
#include "distributed/hierarchy.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/error.h"
#include "simulate/linear/aggregate.h"
#include "simulate/linear/block_inverse.h"

namespace flexel::distributed {
namespace {

using simulate::Aggregates;
using simulate::Block;
using simulate::kNoAggregate;

constexpr double kStrongLink = .01, kAnyLink = 1e-12;  // as in simulate/linear/multigrid.cpp
constexpr PetscInt kCoarsestUnknowns = 1000;           // which are factorised
constexpr double kRaised = 1e-9;  // share of a diagonal, for motions that a group cannot make
constexpr int kEigenvalueSteps = 12;

// The array of a vector while it lives.
class WriteArray {
 public:
  explicit WriteArray(Vec vector) : vector_(vector) { ok(VecGetArray(vector_, &values_)); }
  ~WriteArray() { (void)VecRestoreArray(vector_, &values_); }
  WriteArray(const WriteArray&) = delete;
  WriteArray& operator=(const WriteArray&) = delete;
  [[nodiscard]] double* data() const { return values_; }
  [[nodiscard]] Eigen::Map<Vec3> operator[](std::size_t i) const { return Eigen::Map<Vec3>(values_ + 3 * i); }

 private:
  Vec vector_;
  double* values_ = nullptr;
};

class ReadArray {
 public:
  explicit ReadArray(Vec vector) : vector_(vector) { ok(VecGetArrayRead(vector_, &values_)); }
  ~ReadArray() { (void)VecRestoreArrayRead(vector_, &values_); }
  ReadArray(const ReadArray&) = delete;
  ReadArray& operator=(const ReadArray&) = delete;
  [[nodiscard]] Eigen::Map<const Vec3> operator[](std::size_t i) const {
    return Eigen::Map<const Vec3>(values_ + 3 * i);
  }

 private:
  Vec vector_;
  const double* values_ = nullptr;
};

PetscInt sum_before(PetscInt own, PetscInt& all) {
  PetscInt before = 0;
  ok(MPI_Exscan(&own, &before, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  ok(MPI_Allreduce(&own, &all, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  return rank() == 0 ? 0 : before;
}

}  // namespace

Hierarchy::Hierarchy(PieceSystem& system)
    : system_(system),
      work_(system.vector()),
      image_(system.vector()),
      residual_(system.vector()),
      local_residual_(system.local_vector()),
      moved_(system.local_vector()),
      pulled_(system.local_vector()) {
  ok(PCCreate(PETSC_COMM_WORLD, coarse_.solver.fill()));
  ok(PCSetOptionsPrefix(coarse_.solver, "coarse_"));
}

// GAMG takes a matrix that it need not make coarser to block Jacobi, which is not positive then: each rank factorises it.
void Hierarchy::choose_solver() {
  const bool small = 6 * all_groups_ <= kCoarsestUnknowns;
  ok(PCSetType(coarse_.solver, small ? PCREDUNDANT : PCGAMG));
  if (!small) ok(PCGAMGSetCoarseEqLim(coarse_.solver, kCoarsestUnknowns));
  try {
    ok(PCSetFromOptions(coarse_.solver));
  } catch (const std::runtime_error& error) {
    throw InputError(std::string("--petsc: ") + error.what());
  }
}

// Of elements that this rank owns, by their links among each other.
void Hierarchy::make_groups() {
  const Body& body = system_.body();
  const simulate::OperatorView matrix(system_.own());
  std::vector<std::uint8_t> strength =
      simulate::link_strengths(system_.own(), std::array{kAnyLink, kStrongLink});
  const std::vector<PetscInt>& place = system_.places();
  for (std::size_t i = 0; i < matrix.rows(); ++i)
    for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q)
      if (place[i] < 0 || place[matrix.columns[q]] < 0) strength[q] = 0;
  const simulate::LevelNodes nodes{body.lattice_index, element_parts(body), body.rest,
                                   std::vector<double>(body.element_count(), 0)};
  const Aggregates groups = aggregate(nodes, {matrix.offsets, matrix.columns, strength, 1},
                                      {matrix.offsets, matrix.columns, strength, 2},
                                      {.width = 3, .smallest = 4, .drop_isolated = true});
  strength = {};
  own_groups_ = static_cast<PetscInt>(groups.count());
  first_group_ = sum_before(own_groups_, all_groups_);
  choose_solver();
  const auto count = static_cast<std::size_t>(own_groups_) + [&] {
    std::vector<PetscInt> others = groups_of_others(groups.of);
    make_coarse_vectors(others);
    return others.size();
  }();
  transfer_ = simulate::transfer_pattern<3>(matrix, group_of_, count);
  pattern_ = simulate::coarse_pattern<3>(matrix, transfer_);
  make_coarse_matrix();
}

// Sets group_of_; returns the numbers of those groups of other ranks that this piece's elements are in, ascending.
std::vector<PetscInt> Hierarchy::groups_of_others(const std::vector<std::uint32_t>& own) {
  const std::vector<PetscInt>& place = system_.places();
  {
    const WriteArray numbers(work_);
    for (std::size_t e = 0; e < place.size(); ++e)
      if (place[e] >= 0)
        numbers[static_cast<std::size_t>(place[e])].setConstant(
            own[e] == kNoAggregate ? -1 : static_cast<double>(first_group_ + static_cast<PetscInt>(own[e])));
  }
  const std::vector<Vec3> number = system_.local(work_);
  std::vector<PetscInt> others;
  for (std::size_t e = 0; e < place.size(); ++e)
    if (place[e] < 0 && number[e].x() >= 0) others.push_back(static_cast<PetscInt>(number[e].x()));
  std::sort(others.begin(), others.end());
  others.erase(std::unique(others.begin(), others.end()), others.end());
  group_of_ = own;
  for (std::size_t e = 0; e < place.size(); ++e)
    if (place[e] < 0 && number[e].x() >= 0) {
      const auto at = std::lower_bound(others.begin(), others.end(), static_cast<PetscInt>(number[e].x()));
      group_of_[e] = static_cast<std::uint32_t>(own_groups_ + (at - others.begin()));
    }
  return others;
}

void Hierarchy::make_coarse_vectors(const std::vector<PetscInt>& others) {
  std::vector<PetscInt> numbers;
  for (PetscInt g = 0; g < own_groups_; ++g) numbers.push_back(first_group_ + g);
  numbers.insert(numbers.end(), others.begin(), others.end());
  const auto count = static_cast<PetscInt>(numbers.size());
  ok(ISLocalToGlobalMappingCreate(PETSC_COMM_WORLD, 6, count, numbers.data(), PETSC_COPY_VALUES,
                                  coarse_.numbering.fill()));
  ok(VecCreate(PETSC_COMM_WORLD, coarse_.answer.fill()));
  ok(VecSetSizes(coarse_.answer, 6 * own_groups_, PETSC_DETERMINE));
  ok(VecSetBlockSize(coarse_.answer, 6));
  ok(VecSetType(coarse_.answer, VECSTANDARD));
  ok(VecDuplicate(coarse_.answer, coarse_.right_hand_side.fill()));
  ok(VecCreateSeq(PETSC_COMM_SELF, 6 * count, coarse_.local.fill()));
  Indices blocks;
  ok(ISCreateBlock(PETSC_COMM_SELF, 6, count, numbers.data(), PETSC_COPY_VALUES, blocks.fill()));
  ok(VecScatterCreate(coarse_.answer, blocks, coarse_.local, nullptr, coarse_.to_local.fill()));
}

// With room for what every rank adds: blocks that two have are counted twice.
void Hierarchy::make_coarse_matrix() {
  const std::size_t count = pattern_.offsets.size() - 1;
  const PetscInt* number = nullptr;
  ok(ISLocalToGlobalMappingGetBlockIndices(coarse_.numbering, &number));
  std::vector<PetscInt> begins(static_cast<std::size_t>(ranks()) + 1, 0);
  ok(MPI_Allgather(&first_group_, 1, MPIU_INT, begins.data(), 1, MPIU_INT, PETSC_COMM_WORLD));
  begins.back() = all_groups_;
  const auto owner = [&](PetscInt group) {
    return std::upper_bound(begins.begin(), begins.end() - 1, group) - begins.begin();
  };
  {
    const WriteArray counts(coarse_.local);
    std::fill_n(counts.data(), 6 * count, 0.0);
    for (std::size_t g = 0; g < count; ++g)
      for (std::uint64_t q = pattern_.offsets[g]; q < pattern_.offsets[g + 1]; ++q)
        ++counts.data()[6 * g + (owner(number[pattern_.columns[q]]) == owner(number[g]) ? 0 : 1)];
  }
  ok(ISLocalToGlobalMappingRestoreBlockIndices(coarse_.numbering, &number));
  ok(VecZeroEntries(coarse_.answer));
  ok(VecScatterBegin(coarse_.to_local, coarse_.local, coarse_.answer, ADD_VALUES, SCATTER_REVERSE));
  ok(VecScatterEnd(coarse_.to_local, coarse_.local, coarse_.answer, ADD_VALUES, SCATTER_REVERSE));
  std::vector<PetscInt> near, far;
  {
    const WriteArray counts(coarse_.answer);
    for (PetscInt g = 0; g < own_groups_; ++g) {
      near.push_back(std::min(static_cast<PetscInt>(counts.data()[6 * g]), own_groups_));
      far.push_back(std::min(static_cast<PetscInt>(counts.data()[6 * g + 1]), all_groups_ - own_groups_));
    }
  }
  ok(MatCreate(PETSC_COMM_WORLD, coarse_.matrix.fill()));
  ok(MatSetSizes(coarse_.matrix, 6 * own_groups_, 6 * own_groups_, PETSC_DETERMINE, PETSC_DETERMINE));
  ok(MatSetBlockSize(coarse_.matrix, 6));
  ok(MatSetType(coarse_.matrix, MATAIJ));
  ok(MatXAIJSetPreallocation(coarse_.matrix, 6, near.data(), far.data(), nullptr, nullptr));
  ok(MatSetLocalToGlobalMapping(coarse_.matrix, coarse_.numbering, coarse_.numbering));
  ok(MatSetOption(coarse_.matrix, MAT_SYMMETRIC, PETSC_TRUE));
}

// About the middles of the groups where they are now.
simulate::Grouping Hierarchy::grouping(Vec displacement) {
  const std::vector<Vec3> moved = system_.local(displacement);
  const Body& body = system_.body();
  const auto at = [&](std::size_t e) -> Vec3 { return body.rest[e] + moved[e]; };
  const auto own = static_cast<std::size_t>(own_groups_), count = transfer_.coarse_rows;
  std::vector<double> members(own, 0);
  centre_.assign(count, Vec3::Zero());
  reach_.assign(count, 0);
  const auto each_own = [&](const auto& use) {
    for (std::size_t e = 0; e < moved.size(); ++e)
      if (group_of_[e] < own) use(e, group_of_[e]);
  };
  each_own([&](std::size_t e, std::uint32_t g) {
    centre_[g] += at(e);
    ++members[g];
  });
  for (std::size_t g = 0; g < own; ++g) centre_[g] /= members[g];
  each_own(
      [&](std::size_t e, std::uint32_t g) { reach_[g] = std::max(reach_[g], (at(e) - centre_[g]).norm()); });
  {
    const WriteArray told(coarse_.answer);
    for (std::size_t g = 0; g < own; ++g) {
      if (!(reach_[g] > 0)) reach_[g] = 1;
      Eigen::Map<Vec3>(told.data() + 6 * g) = centre_[g];
      told.data()[6 * g + 3] = reach_[g];
    }
  }
  ok(VecScatterBegin(coarse_.to_local, coarse_.answer, coarse_.local, INSERT_VALUES, SCATTER_FORWARD));
  ok(VecScatterEnd(coarse_.to_local, coarse_.answer, coarse_.local, INSERT_VALUES, SCATTER_FORWARD));
  const WriteArray told(coarse_.local);
  for (std::size_t g = own; g < count; ++g) {
    centre_[g] = Eigen::Map<const Vec3>(told.data() + 6 * g);
    reach_[g] = told.data()[6 * g + 3];
  }
  simulate::Grouping result{group_of_, std::vector<Vec3>(moved.size(), Vec3::Zero()), {}, reach_};
  for (std::size_t e = 0; e < moved.size(); ++e)
    if (group_of_[e] != kNoAggregate) result.offset[e] = at(e) - centre_[group_of_[e]];
  return result;
}

std::vector<Block> Hierarchy::whole_diagonal() {
  std::vector<Block> diagonal = system_.own().diagonal();
  std::vector<Vec3> column(diagonal.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t e = 0; e < column.size(); ++e) column[e] = diagonal[e].col(axis);
    ok(VecZeroEntries(work_));
    system_.add(column, work_);
    column = system_.local(work_);
    for (std::size_t e = 0; e < column.size(); ++e) diagonal[e].col(axis) = column[e];
  }
  return diagonal;
}

// Returns the diagonal blocks of all ranks together (elements of the piece).
std::vector<Block> Hierarchy::make_smoother() {
  std::vector<Block> diagonal = whole_diagonal();
  double own = 0, largest = 0;
  for (const Block& block : diagonal) own = std::max(own, block.diagonal().cwiseAbs().maxCoeff());
  ok(MPI_Allreduce(&own, &largest, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  inverse_diagonal_.resize(static_cast<std::size_t>(system_.owned()));
  for (std::size_t e = 0; e < diagonal.size(); ++e)
    if (const PetscInt place = system_.places()[e]; place >= 0)
      inverse_diagonal_[static_cast<std::size_t>(place)] =
          simulate::guarded_inverse<3>(diagonal[e], 1e-14 * largest).cast<float>();
  const double eigenvalue = largest_eigenvalue();
  smoother_ = simulate::chebyshev(1.1 * eigenvalue);
  if (!made()) weight_ = simulate::smoothing_weight(eigenvalue);
  return diagonal;
}

// Of D^-1 A, from below, by power iteration.
double Hierarchy::largest_eigenvalue() {
  PetscInt first = 0;
  ok(VecGetOwnershipRange(work_, &first, nullptr));
  {
    const WriteArray start(work_);
    for (PetscInt i = 0; i < 3 * system_.owned(); ++i)
      start.data()[i] = simulate::scattered(static_cast<std::uint64_t>(first + i));
  }
  double largest = 1;
  for (int step = 0; step < kEigenvalueSteps; ++step) {
    const double before = norm(work_);
    system_.multiply(work_, image_);
    scale(image_, work_);
    const double after = norm(work_);
    if (!(after > 0) || !std::isfinite(after)) break;
    largest = after / before;
    ok(VecScale(work_, 1 / after));
  }
  return largest;
}

// Elements that a support holds do not follow their groups.
void Hierarchy::restrain(const std::vector<Block>& diagonal) {
  std::vector<Mat3> sum(diagonal.size());
  for (int axis = 0; axis < 3; ++axis) {
    {
      const WriteArray unit(work_);
      for (PetscInt i = 0; i < system_.owned(); ++i) unit[static_cast<std::size_t>(i)] = Vec3::Unit(axis);
    }
    system_.multiply(work_, image_);
    const std::vector<Vec3> pulled = system_.local(image_);
    for (std::size_t e = 0; e < sum.size(); ++e) sum[e].col(axis) = pulled[e];
  }
  std::vector<std::pair<std::uint32_t, Mat3>> free;
  for (std::uint32_t e = 0; e < sum.size(); ++e)
    if (const Mat3 each = simulate::free_directions(sum[e], diagonal[e]); each != Mat3::Identity())
      free.emplace_back(e, each);
  rigid_->restrain(std::move(free));
}

void Hierarchy::refresh_smoother() {
  (void)make_smoother();
}

void Hierarchy::refresh(Vec displacement) {
  if (!made()) make_groups();
  rigid_.reset();
  const std::vector<Block> diagonal = make_smoother();
  rigid_.emplace(grouping(displacement));
  restrain(diagonal);
  if (all_groups_ == 0) return;
  fill_coarse_matrix();
  mend_diagonal();
  set_near_null_space();
  ok(PCSetOperators(coarse_.solver, coarse_.matrix, coarse_.matrix));
  ok(PCSetUp(coarse_.solver));
}

void Hierarchy::fill_coarse_matrix() {
  const simulate::OperatorView matrix(system_.own());
  std::vector<Inverse> inverse(matrix.rows(), Inverse::Zero());  // 0 where others have the element too
  for (std::size_t e = 0; e < inverse.size(); ++e)
    if (!system_.shared()[e]) inverse[e] = inverse_diagonal_[static_cast<std::size_t>(system_.places()[e])];
  simulate::smooth_prolongator<3>(
      matrix, inverse, weight_, group_of_, [&](std::size_t e) { return rigid_->at(e); }, transfer_);
  inverse = {};
  const std::vector<simulate::Square<6>> blocks = simulate::galerkin<3>(matrix, transfer_, pattern_);
  transfer_.values = {};
  ok(MatZeroEntries(coarse_.matrix));
  std::vector<PetscInt> columns;
  std::vector<double> values;
  for (std::size_t g = 0; g + 1 < pattern_.offsets.size(); ++g) {
    const std::uint64_t begin = pattern_.offsets[g], width = pattern_.offsets[g + 1] - begin;
    columns.assign(pattern_.columns.begin() + static_cast<std::ptrdiff_t>(begin),
                   pattern_.columns.begin() + static_cast<std::ptrdiff_t>(begin + width));
    values.resize(36 * width);
    for (std::size_t q = 0; q < width; ++q)
      for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t j = 0; j < 6; ++j)
          values[(i * width + q) * 6 + j] =
              blocks[begin + q](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    const auto row = static_cast<PetscInt>(g);
    ok(MatSetValuesBlockedLocal(coarse_.matrix, 1, &row, static_cast<PetscInt>(width), columns.data(),
                                values.data(), ADD_VALUES));
  }
  ok(MatAssemblyBegin(coarse_.matrix, MAT_FINAL_ASSEMBLY));
  ok(MatAssemblyEnd(coarse_.matrix, MAT_FINAL_ASSEMBLY));
}

// Groups of few elements, or of held ones, cannot make all six motions: what they cannot is to resist all the same.
void Hierarchy::mend_diagonal() {
  Vector diagonal;
  ok(VecDuplicate(coarse_.answer, diagonal.fill()));
  ok(MatGetDiagonal(coarse_.matrix, diagonal));
  double largest = 0;
  ok(VecNorm(diagonal, NORM_INFINITY, &largest));
  {
    const WriteArray values(diagonal);
    for (PetscInt i = 0; i < 6 * own_groups_; ++i) {
      double& value = values.data()[i];
      value = value > kRaised * largest ? (1 + kRaised) * value : largest;
    }
  }
  ok(MatDiagonalSet(coarse_.matrix, diagonal, INSERT_VALUES));
}

// The six motions of the whole as a rigid body, in the unknowns of the groups.
void Hierarchy::set_near_null_space() {
  std::array<Vector, 6> motions;
  for (int m = 0; m < 6; ++m) {
    Vector& motion = motions[static_cast<std::size_t>(m)];
    ok(VecDuplicate(coarse_.answer, motion.fill()));
    const Vec3 along = Vec3::Unit(m % 3);
    const WriteArray values(motion);
    for (PetscInt g = 0; g < own_groups_; ++g) {
      const auto i = static_cast<std::size_t>(g);
      Eigen::Map<Vec3>(values.data() + 6 * g) = m < 3 ? along : Vec3(along.cross(centre_[i]));
      Eigen::Map<Vec3>(values.data() + 6 * g + 3) = m < 3 ? Vec3(Vec3::Zero()) : Vec3(reach_[i] * along);
    }
  }
  std::array<Vec, 6> base{};
  for (std::size_t m = 0; m < 6; ++m) {
    base[m] = motions[m];
    for (std::size_t k = 0; k < m; ++k) {
      double along = 0;
      ok(VecDot(base[m], base[k], &along));
      ok(VecAXPY(base[m], -along, base[k]));
    }
    ok(VecNormalize(base[m], nullptr));
  }
  NullSpace space;
  ok(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 6, base.data(), space.fill()));
  ok(MatSetNearNullSpace(coarse_.matrix, space));
}

// to = D^-1 residual
void Hierarchy::scale(Vec residual, Vec to) const {
  const ReadArray from(residual);
  const WriteArray result(to);
  for (std::size_t i = 0; i < inverse_diagonal_.size(); ++i)
    result[i] = inverse_diagonal_[i].cast<double>() * from[i];
}

// x += P B P^T residual, B: GAMG's cycle.
void Hierarchy::add_coarse(Vec residual, Vec x) {
  if (all_groups_ == 0) return;
  const std::vector<std::uint8_t>& shared = system_.shared();
  const std::vector<PetscInt>& place = system_.places();
  const auto inverse = [&](std::size_t e) {
    return Mat3(weight_ * inverse_diagonal_[static_cast<std::size_t>(place[e])].cast<double>());
  };
  system_.forward(residual, local_residual_);
  {
    const WriteArray left(local_residual_), moved(moved_), pulled(pulled_), coarse(coarse_.local);
    for (std::size_t e = 0; e < place.size(); ++e)
      moved[e] = shared[e] ? Vec3(Vec3::Zero()) : Vec3(inverse(e) * left[e]);
    system_.own().multiply(moved.data(), pulled.data());
    rigid_->collect(
        [&](std::size_t e) -> Vec3 { return place[e] < 0 ? Vec3(-pulled[e]) : Vec3(left[e] - pulled[e]); },
        coarse.data());
  }
  ok(VecZeroEntries(coarse_.right_hand_side));
  ok(VecScatterBegin(coarse_.to_local, coarse_.local, coarse_.right_hand_side, ADD_VALUES, SCATTER_REVERSE));
  ok(VecScatterEnd(coarse_.to_local, coarse_.local, coarse_.right_hand_side, ADD_VALUES, SCATTER_REVERSE));
  ok(PCApply(coarse_.solver, coarse_.right_hand_side, coarse_.answer));
  ok(VecScatterBegin(coarse_.to_local, coarse_.answer, coarse_.local, INSERT_VALUES, SCATTER_FORWARD));
  ok(VecScatterEnd(coarse_.to_local, coarse_.answer, coarse_.local, INSERT_VALUES, SCATTER_FORWARD));
  const WriteArray moved(moved_), pulled(pulled_), coarse(coarse_.local), result(x);
  rigid_->spread(coarse.data(), moved.data());
  system_.own().multiply(moved.data(), pulled.data());
  for (std::size_t e = 0; e < place.size(); ++e) {
    if (place[e] < 0) continue;
    Eigen::Map<Vec3> to = result[static_cast<std::size_t>(place[e])];
    to += moved[e];
    if (!shared[e]) to -= inverse(e) * pulled[e];
  }
}

void Hierarchy::apply(Vec residual, Vec x) {
  const auto& [inverse_centre, momentum, gain] = smoother_;
  scale(residual, work_);
  ok(VecScale(work_, inverse_centre));
  system_.multiply(work_, image_);
  ok(VecWAXPY(residual_, -1, image_, residual));
  scale(residual_, x);
  ok(VecAXPBY(x, 1 + momentum, gain, work_));
  system_.multiply(x, image_);
  ok(VecWAXPY(residual_, -1, image_, residual));
  add_coarse(residual_, x);
  system_.multiply(x, image_);
  ok(VecWAXPY(residual_, -1, image_, residual));
  scale(residual_, work_);
  ok(VecAYPX(work_, inverse_centre, x));
  system_.multiply(work_, image_);
  ok(VecWAXPY(residual_, -1, image_, residual));
  scale(residual_, image_);
  ok(VecAXPBYPCZ(x, 1 + momentum, gain, -momentum, work_, image_));
}

}  // namespace flexel::distributed
