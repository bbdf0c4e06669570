// What rank 0's effects do to a piece is an effect of the piece's own: blocks of stiffness, and a mask.
#include "distributed/piece_system.h"

#include <algorithm>

namespace flexel::distributed {
namespace {

using simulate::Block;
using simulate::BlockMatrix;
using simulate::State;

class PieceEffects : public simulate::Effect {
 public:
  explicit PieceEffects(const Piece& piece) : piece_(piece) {}
  [[nodiscard]] std::string why() const override { return "of rank 0"; }
  [[nodiscard]] bool adds_stiffness() const override { return !piece_.added.empty(); }
  [[nodiscard]] double energy(const State& state) override {
    double energy = 0;
    for (const AddedBlock& block : piece_.added)
      energy += 0.5 * state.displacement[block.row].dot(value_of(block) * state.displacement[block.column]);
    return energy;
  }
  void add_forces(const State& state, std::vector<Vec3>& forces) override {
    for (const AddedBlock& block : piece_.added)
      forces[block.row] -= value_of(block) * state.displacement[block.column];
  }
  void add_stiffness(const State&, BlockMatrix& matrix) override {
    for (const AddedBlock& block : piece_.added)
      matrix.values[position_of(matrix, block.row, block.column)] += value_of(block);
  }
  void constrain(simulate::Constraints& constraints) override { constraints.mask = piece_.mask; }

 private:
  static Eigen::Map<const Block> value_of(const AddedBlock& block) {
    return Eigen::Map<const Block>(block.value.data());
  }
  const Piece& piece_;
};

std::vector<simulate::ActiveEffect> effects_of(const Piece& piece) {
  std::vector<simulate::ActiveEffect> effects;
  effects.emplace_back("effects", std::make_unique<PieceEffects>(piece));
  return effects;
}

// An exception must not cross PETSc's frames.
template <class Call>
PetscErrorCode guarded(Mat matrix, const Call& call) {
  void* context = nullptr;
  if (const PetscErrorCode code = MatShellGetContext(matrix, &context)) return code;
  try {
    call(*static_cast<PieceSystem*>(context));
    return 0;
  } catch (const std::bad_alloc&) {
    return PETSC_ERR_MEM;
  } catch (const std::exception&) {
    return PETSC_ERR_LIB;
  }
}

}  // namespace

PieceSystem::PieceSystem(Piece piece, const simulate::Scene& scene)
    : piece_(std::move(piece)),
      problem_{piece_.body,
               simulate::materials_of_parts(scene, piece_.body),
               {},
               simulate::models_of_parts(scene, piece_.body)},
      mechanics_(problem_, effects_of(piece_), simulate::StiffnessStorage::made) {
  make_vectors();
  make_matrix();
}

void PieceSystem::make_vectors() {
  const auto count = static_cast<PetscInt>(piece_.number.size());
  ok(VecCreate(PETSC_COMM_WORLD, global_.fill()));
  ok(VecSetSizes(global_, 3 * piece_.owned, PETSC_DETERMINE));
  ok(VecSetBlockSize(global_, 3));
  ok(VecSetType(global_, VECSTANDARD));
  ok(VecCreateSeq(PETSC_COMM_SELF, 3 * count, local_.fill()));
  ok(VecDuplicate(local_, image_.fill()));
  Indices blocks;
  ok(ISCreateBlock(PETSC_COMM_SELF, 3, count, piece_.number.data(), PETSC_COPY_VALUES, blocks.fill()));
  ok(VecScatterCreate(global_, blocks, local_, nullptr, to_local_.fill()));
  PetscInt first = 0;
  ok(VecGetOwnershipRange(global_, &first, nullptr));
  for (const PetscInt number : piece_.number) {
    const PetscInt place = number - first / 3;
    place_.push_back(place >= 0 && place < piece_.owned ? place : -1);
  }
  Vector sharers = vector();
  add(std::vector<Vec3>(piece_.number.size(), Vec3::Ones()), sharers);
  for (const Vec3& each : local(sharers)) shared_.push_back(each.x() > 1);
  free_ = vector();
  // Every rank that has an element knows its mask: how many held it, and how many did not.
  std::vector<Vec3> open(piece_.number.size());
  for (std::size_t e = 0; e < open.size(); ++e)
    for (int axis = 0; axis < 3; ++axis) open[e][axis] = piece_.mask[e] >> axis & 1 ? 0 : 1;
  add(open, free_);
  double* values = nullptr;
  ok(VecGetArray(free_, &values));
  for (PetscInt i = 0; i < 3 * piece_.owned; ++i) values[i] = values[i] > 0 ? 1 : 0;
  ok(VecRestoreArray(free_, &values));
}

Vector PieceSystem::vector() const {
  Vector made;
  ok(VecDuplicate(global_, made.fill()));
  ok(VecZeroEntries(made));
  return made;
}

Vector PieceSystem::local_vector() const {
  Vector made;
  ok(VecDuplicate(local_, made.fill()));
  return made;
}

void PieceSystem::make_matrix() {
  const PetscInt own = 3 * piece_.owned;
  ok(MatCreateShell(PETSC_COMM_WORLD, own, own, PETSC_DETERMINE, PETSC_DETERMINE, this, matrix_.fill()));
  ok(MatSetBlockSize(matrix_, 3));
  PetscErrorCode (*product_of)(Mat, Vec, Vec) = [](Mat matrix, Vec x, Vec y) {
    return guarded(matrix, [&](PieceSystem& self) { self.product(x, y); });
  };
  PetscErrorCode (*get_diagonal)(Mat, Vec) = [](Mat matrix, Vec to) {
    return guarded(matrix, [&](PieceSystem& self) { self.diagonal(to); });
  };
  ok(MatShellSetOperation(matrix_, MATOP_MULT, reinterpret_cast<void (*)()>(product_of)));
  ok(MatShellSetOperation(matrix_, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(get_diagonal)));
  ok(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
  ok(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  ok(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

void PieceSystem::forward(Vec from, Vec to_local) {
  ok(VecScatterBegin(to_local_, from, to_local, INSERT_VALUES, SCATTER_FORWARD));
  ok(VecScatterEnd(to_local_, from, to_local, INSERT_VALUES, SCATTER_FORWARD));
}

void PieceSystem::add(Vec local, Vec to) {
  ok(VecScatterBegin(to_local_, local, to, ADD_VALUES, SCATTER_REVERSE));
  ok(VecScatterEnd(to_local_, local, to, ADD_VALUES, SCATTER_REVERSE));
}

std::vector<Vec3> PieceSystem::local(Vec values) {
  forward(values, local_);
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
  add(local_, to);
}

void PieceSystem::multiply(Vec x, Vec y) {
  ok(MatMult(matrix_, x, y));
}

void PieceSystem::product(Vec x, Vec y) {
  forward(x, local_);
  const double* from = nullptr;
  double* to = nullptr;
  ok(VecGetArrayRead(local_, &from));
  ok(VecGetArray(image_, &to));
  own().multiply(from, to);
  ok(VecRestoreArray(image_, &to));
  ok(VecRestoreArrayRead(local_, &from));
  ok(VecZeroEntries(y));
  add(image_, y);
}

void PieceSystem::diagonal(Vec to) {
  std::vector<Vec3> own_share;
  for (const Block& block : own().diagonal()) own_share.emplace_back(block.diagonal());
  ok(VecZeroEntries(to));
  add(own_share, to);
}

double PieceSystem::energy(Vec displacement, Vec outer) {
  const double own = mechanics_.energy({local(displacement), 1});
  double work = 0;
  ok(VecDot(displacement, outer, &work));
  return sum(own) - work;
}

simulate::CellsElsewhere::Figures PieceSystem::figures(Vec displacement) {
  const State state{local(displacement), 1};
  const auto least = [&](const simulate::SmallestJacobian& own) {
    const std::array<double, 3> mine = {own.value, static_cast<double>(piece_.cell[own.cell]),
                                        static_cast<double>(own.corner)};
    std::vector<std::array<double, 3>> all(static_cast<std::size_t>(ranks()));
    ok(MPI_Allgather(mine.data(), 3, MPI_DOUBLE, all.data(), 3, MPI_DOUBLE, PETSC_COMM_WORLD));
    const std::array<double, 3>& found = *std::min_element(all.begin(), all.end());
    return simulate::SmallestJacobian{found[0], static_cast<std::uint32_t>(found[1]),
                                      static_cast<std::uint32_t>(found[2])};
  };
  return {sum(mechanics_.cells().energy(state)), least(mechanics_.cells().smallest_jacobian(state)),
          least(mechanics_.cells().smallest_corner_jacobian(state))};
}

void PieceSystem::forces(Vec displacement, Vec outer, Vec inner, Vec of_effects) {
  const State state{local(displacement), 1};
  std::vector<Vec3> own_share(state.displacement.size(), Vec3::Zero());
  mechanics_.add_elastic_forces(state, own_share);
  ok(VecZeroEntries(inner));
  add(own_share, inner);
  ok(VecCopy(outer, of_effects));
  add(mechanics_.forces_of_effects(state), of_effects);
}

std::vector<Mat3> PieceSystem::predicted_stress(Vec before, Vec now) {
  const State state{local(before), 1};
  std::vector<Vec3> step = local(now);
  for (std::size_t e = 0; e < step.size(); ++e) step[e] -= state.displacement[e];
  return mechanics_.cells().predicted_stress(state, step);
}

void PieceSystem::assemble(Vec displacement, const simulate::TangentOptions& tangent, Vec gap, Vec pulled) {
  mechanics_.assemble({local(displacement), 1}, tangent);
  if (gap) product(gap, pulled);
  mechanics_.eliminate_prescribed();
  // So that PETSc's own preconditioners are made anew.
  ok(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  ok(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

}  // namespace flexel::distributed
