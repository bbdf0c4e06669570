// A rank's rows of the matrix are made by the product's own loops, then added row by row to PETSc's.
#include "distributed/piece_system.h"

#include <algorithm>

#include "base/parallel.h"
#include "simulate/conditions/constraints.h"
#include "simulate/linear/operator.h"

namespace flexel::distributed {
namespace {

using simulate::Block;
using simulate::State;

// Blocks of a row whose cells may be on several ranks: of a whole neighbourhood.
constexpr PetscInt kWholeRow = 27;

Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> value_of(const AddedBlock& block) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.value.data());
}

simulate::ConnectionRows no_connections(const Body& body) {
  return {std::vector<std::uint32_t>(body.element_count() + 1, 0), {}};
}

}  // namespace

PieceSystem::PieceSystem(Piece piece, const simulate::Scene& scene)
    : piece_(std::move(piece)),
      problem_{piece_.body,
               simulate::materials_of_parts(scene, piece_.body),
               {},
               simulate::models_of_parts(scene, piece_.body)},
      pattern_(simulate::stiffness_pattern(piece_.body, simulate::active_cells(problem_),
                                           no_connections(piece_.body))),
      cells_(problem_, pattern_.stencil) {
  constraints_.mask = piece_.mask;
  make_vectors();
  make_matrix();
  set_near_null_space();
}

void PieceSystem::make_vectors() {
  const auto count = static_cast<PetscInt>(piece_.number.size());
  ok(ISLocalToGlobalMappingCreate(PETSC_COMM_WORLD, 3, count, piece_.number.data(), PETSC_COPY_VALUES,
                                  numbering_.fill()));
  ok(VecCreate(PETSC_COMM_WORLD, global_.fill()));
  ok(VecSetSizes(global_, 3 * piece_.owned, PETSC_DETERMINE));
  ok(VecSetBlockSize(global_, 3));
  ok(VecSetType(global_, VECSTANDARD));
  ok(VecCreateSeq(PETSC_COMM_SELF, 3 * count, local_.fill()));
  Indices blocks;
  ok(ISCreateBlock(PETSC_COMM_SELF, 3, count, piece_.number.data(), PETSC_COPY_VALUES, blocks.fill()));
  ok(VecScatterCreate(global_, blocks, local_, nullptr, to_local_.fill()));
  free_ = vector();
  // Every rank that has an element knows its mask: how many held it, and how many did not.
  std::vector<Vec3> open(piece_.number.size());
  for (std::size_t e = 0; e < open.size(); ++e)
    for (int axis = 0; axis < 3; ++axis) open[e][axis] = piece_.mask[e] >> axis & 1 ? 0 : 1;
  add(open, free_);
  PetscInt own = 0;
  ok(VecGetLocalSize(free_, &own));
  double* values = nullptr;
  ok(VecGetArray(free_, &values));
  for (PetscInt i = 0; i < own; ++i) values[i] = values[i] > 0 ? 1 : 0;
  ok(VecRestoreArray(free_, &values));
}

Vector PieceSystem::vector() const {
  Vector made;
  ok(VecDuplicate(global_, made.fill()));
  ok(VecZeroEntries(made));
  return made;
}

void PieceSystem::make_matrix() {
  const std::size_t count = piece_.number.size();
  Vector sharers = vector();
  add(std::vector<Vec3>(count, Vec3::Ones()), sharers);
  const std::vector<Vec3> shared = local(sharers);
  PetscInt first = 0, all = 0;
  ok(VecGetOwnershipRange(global_, &first, nullptr));
  ok(VecGetSize(global_, &all));
  first /= 3;
  const PetscInt own = piece_.owned, other = all / 3 - own;
  std::vector<PetscInt> near(static_cast<std::size_t>(own), 0), far(static_cast<std::size_t>(own), 0);
  const auto is_own = [&](PetscInt number) { return number >= first && number < first + own; };
  for (std::size_t e = 0; e < count; ++e) {
    if (!is_own(piece_.number[e])) continue;
    const auto row = static_cast<std::size_t>(piece_.number[e] - first);
    for (std::uint64_t q = pattern_.matrix.row_offsets[e]; q < pattern_.matrix.row_offsets[e + 1]; ++q)
      ++(is_own(piece_.number[pattern_.matrix.columns[q]]) ? near : far)[row];
    if (shared[e].x() > 1) {
      near[row] = std::min(std::max(near[row], kWholeRow), own);
      far[row] = std::min(std::max(far[row], kWholeRow), other);
    }
  }
  ok(MatCreate(PETSC_COMM_WORLD, matrix_.fill()));
  ok(MatSetSizes(matrix_, 3 * own, 3 * own, PETSC_DETERMINE, PETSC_DETERMINE));
  ok(MatSetBlockSize(matrix_, 3));
  ok(MatSetType(matrix_, MATAIJ));
  ok(MatXAIJSetPreallocation(matrix_, 3, near.data(), far.data(), nullptr, nullptr));
  ok(MatSetLocalToGlobalMapping(matrix_, numbering_, numbering_));
  // Where more than 27 elements meet at one, as at pieces of a voxel, rows grow.
  ok(MatSetOption(matrix_, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  ok(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
}

// The six motions of the whole as a rigid body.
void PieceSystem::set_near_null_space() {
  Vector places = vector();
  const auto count = static_cast<PetscInt>(piece_.number.size());
  std::vector<double> rest(3 * piece_.number.size());
  for (std::size_t e = 0; e < piece_.number.size(); ++e)
    std::copy_n(piece_.body.rest[e].data(), 3, &rest[3 * e]);
  ok(VecSetValuesBlocked(places, count, piece_.number.data(), rest.data(), INSERT_VALUES));
  ok(VecAssemblyBegin(places));
  ok(VecAssemblyEnd(places));
  NullSpace motions;
  ok(MatNullSpaceCreateRigidBody(places, motions.fill()));
  ok(MatSetNearNullSpace(matrix_, motions));
}

std::vector<Vec3> PieceSystem::local(Vec values) {
  ok(VecScatterBegin(to_local_, values, local_, INSERT_VALUES, SCATTER_FORWARD));
  ok(VecScatterEnd(to_local_, values, local_, INSERT_VALUES, SCATTER_FORWARD));
  const double* from = nullptr;
  ok(VecGetArrayRead(local_, &from));
  std::vector<Vec3> result(piece_.number.size());
  for (std::size_t e = 0; e < result.size(); ++e) result[e] = Eigen::Map<const Vec3>(from + 3 * e);
  ok(VecRestoreArrayRead(local_, &from));
  return result;
}

void PieceSystem::add(const std::vector<Vec3>& values, Vec to) {
  double* array = nullptr;
  ok(VecGetArray(local_, &array));
  for (std::size_t e = 0; e < values.size(); ++e) Eigen::Map<Vec3>(array + 3 * e) = values[e];
  ok(VecRestoreArray(local_, &array));
  ok(VecScatterBegin(to_local_, local_, to, ADD_VALUES, SCATTER_REVERSE));
  ok(VecScatterEnd(to_local_, local_, to, ADD_VALUES, SCATTER_REVERSE));
}

std::vector<Vec3> PieceSystem::added_product(const std::vector<Vec3>& displacement) const {
  std::vector<Vec3> product(displacement.size(), Vec3::Zero());
  for (const AddedBlock& block : piece_.added)
    product[block.row] += value_of(block) * displacement[block.column];
  return product;
}

double PieceSystem::energy(Vec displacement, Vec outer) {
  const State state{local(displacement), 1};
  double own = cells_.energy(state);
  const std::vector<Vec3> product = added_product(state.displacement);
  for (std::size_t e = 0; e < product.size(); ++e) own += 0.5 * product[e].dot(state.displacement[e]);
  double work = 0;
  ok(VecDot(displacement, outer, &work));
  return sum(own) - work;
}

void PieceSystem::forces(Vec displacement, Vec outer, Vec inner, Vec of_effects) {
  const State state{local(displacement), 1};
  std::vector<Vec3> own(state.displacement.size(), Vec3::Zero());
  cells_.add_forces(state, own);
  ok(VecZeroEntries(inner));
  add(own, inner);
  std::vector<Vec3> product = added_product(state.displacement);
  for (Vec3& force : product) force = -force;
  ok(VecCopy(outer, of_effects));
  add(product, of_effects);
}

std::vector<Mat3> PieceSystem::predicted_stress(Vec before, Vec now) {
  const State state{local(before), 1};
  std::vector<Vec3> step = local(now);
  for (std::size_t e = 0; e < step.size(); ++e) step[e] -= state.displacement[e];
  return cells_.predicted_stress(state, step);
}

void PieceSystem::assemble(Vec displacement, const simulate::TangentOptions& tangent, Vec gap, Vec pulled) {
  cells_.set_stiffness({local(displacement), 1}, tangent, pattern_.matrix);
  for (const AddedBlock& block : piece_.added)
    pattern_.matrix.values[position_of(pattern_.matrix, block.row, block.column)] += value_of(block);
  if (gap) {
    const std::vector<Vec3> way = local(gap);
    std::vector<Vec3> force(way.size());
    simulate::multiply(pattern_.matrix, way, force);
    ok(VecZeroEntries(pulled));
    add(force, pulled);
  }
  simulate::eliminate(constraints_, pattern_.matrix);
  insert_rows();
}

void PieceSystem::insert_rows() {
  ok(MatZeroEntries(matrix_));
  std::vector<PetscInt> columns;
  std::vector<double> values;
  for (std::size_t e = 0; e < piece_.number.size(); ++e) {
    const std::uint64_t begin = pattern_.matrix.row_offsets[e], end = pattern_.matrix.row_offsets[e + 1];
    const std::size_t width = end - begin;
    columns.assign(pattern_.matrix.columns.begin() + static_cast<std::ptrdiff_t>(begin),
                   pattern_.matrix.columns.begin() + static_cast<std::ptrdiff_t>(end));
    values.resize(9 * width);
    for (std::size_t q = 0; q < width; ++q)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          values[(i * width + q) * 3 + j] =
              pattern_.matrix.values[begin + q](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    const auto row = static_cast<PetscInt>(e);
    ok(MatSetValuesBlockedLocal(matrix_, 1, &row, static_cast<PetscInt>(width), columns.data(), values.data(),
                                ADD_VALUES));
  }
  ok(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  ok(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

}  // namespace flexel::distributed
