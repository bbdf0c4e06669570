// One chunk of one step: gather the state of its elements, sum the forces of its cells eight at a time,
// advance the elements that are its own. Compiled once per instruction set (FLEXEL_ISA); contraction is off,
// so the bits agree between them.
//
// Model `cells` (simulate/models/cell_model.h) in the lattice frame. With the sums D_j = sum_a s_aj u_a and Q_m =
// sum_a s_ma u_a of an 8-point Walsh-Hadamard transform,
//     H_.j = D_j / (4 h_j),  q_m = Q_m / 8,
//     f_a = -fill V { 1/4 sum_j P_.j s_aj / h_j + sum_m s_ma f_m }:  the same transform backwards,
// with the sums Q and constants over 64 V f_m = c_m Q_m + r_m, r_m = cof F (K p)_m, p_m = F^-1 Q_m, and P has
// 1/2 p K p cof F - sum_m r_m p_m^T of the latter.
// P is that of the part's law (simulate/laws).
//
// Damping with time tau is the power of the rate of strain, A = sym(F^T dF/dt) without its trace, and of that of the
// volume: P_v = tau (2 mu F dev A + K dJ/dt cof F), K = lambda + 2 mu / 3. (The trace of A is not 0 at constant volume
// where F is far from a rotation, and K may be thousands of mu.) Of orthotropic laws P_v = tau F C A, C the moduli at
// rest. For the hourglass modes it is that of their rate as seen by an observer that is deformed with the cell, q' =
// dq/dt - dF/dt F^-1 q = F dp/dt: tau (c_m |q'|^2 + dp/dt K dp/dt). The dissipation does not change under any rigid motion of
// the velocities, so linear and angular momentum are kept exactly.
//
// Model `springs` (simulate/models/spring_model.h): F = -k (d - l) along each spring, Jansson and Vergeest eqs. 15,
// 16, 18; d - l = (d^2 - l^2) / (d + l) with d^2 - l^2 from the displacements, without cancellation. Cell by
// cell where springs flow or break, else connection by connection.
#include "simulate/kernels/kernel.h"

#include "simulate/kernels/kernel_connections.h"
#include "simulate/kernels/kernel_elements.h"
#include "simulate/kernels/kernel_plastic.h"
#include "simulate/kernels/kernel_springs.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::simulate::step {
namespace {

struct CellsModel {
  static constexpr bool by_connection = false;

  template <Composition has>
  FLEXEL_INLINE static void add_block(const ChunkView& chunk, std::size_t number, const Advance& advance,
                                      const Scratch& scratch, Sums& sums) {
    CellBlock& block = chunk.blocks[number];
    const CellConstants& k = *chunk.constants;
    const Lanes fill = load(block.fill);
    Lanes matter = fill;  // the share of the voxel; that volume in the rest shape
    Corners corners;
    Modes u[3], v[3];
    read_corners(chunk, block, scratch.column + kDisplacement, corners);
    for (int i = 0; i < 3; ++i) u[i] = transform(corners, i);
    const Gradient g = gradient_of(u, k, fill, sums);
    constexpr int drawn_modes = has.damping != Damping::none ? 4 : 3;  // the last one by its rate alone
    [[maybe_unused]] const Drawn drawn = drawn_back<drawn_modes>(g, u);
    Matrix stress;
    Lanes mode_force[4][3];
    [[maybe_unused]] Elastic now;
    const bool neo_hooke = k.law.name == LawName::neo_hooke;
    bool elastic = true;
    if constexpr (has.plasticity) elastic = !neo_hooke;  // other laws do not flow
    if (elastic) {
      stress = elastic_stress<has>(g, k, fill, now, sums);
      add_hourglass(g, drawn, u, k, stress, mode_force);
      if constexpr (has.fracture || has.plasticity) now.hourglass_square = hourglass_square(u, mode_force);
    } else if constexpr (has.plasticity) {
      PlasticBlock& memory = chunk.plastic[number];
      matter = fill * (1 + load(memory.volume));
      now = plastic_state(g, u, k, matter, memory, sums);
      stress = plastic_stress(g, now, k, memory);
      for (int m = 0; m < 4; ++m)
        for (int i = 0; i < 3; ++i) mode_force[m][i] = now.mode_force[m][i];
    }
    if constexpr (has.damping != Damping::none) {
      read_corners(chunk, block, scratch.column + kVelocity, corners);
      for (int i = 0; i < 3; ++i) v[i] = transform(corners, i);
    }
    if constexpr (has.fracture) {
      LaneMask broken = breaks(now, k, fill);
      if constexpr (has.plasticity)
        broken |= (load(chunk.plastic[number].strain) > k.elongation) & (fill > 0);
      if (any(broken)) {
        for (std::size_t l = 0; l < kLanes; ++l) sums.broken += broken[l] != 0;
        const Lanes lost = broken ? matter : Lanes{};
        if constexpr (has.damping == Damping::book)
          sums.released +=
              released_energy(stress, mode_force, elastic_energy(now, k), lost, k, advance, corners);
        store(block.fill, broken ? Lanes{} : fill);
        matter = broken ? Lanes{} : matter;
      }
    }
    if constexpr (has.damping == Damping::book && (has.fracture || has.plasticity)) {
      const Lanes energy = matter * (neo_hooke ? elastic_energy(now, k) : energy_by_law(g, now, k));
      sums.elastic += matter > 0 ? energy : Lanes{};
    }
    if constexpr (has.damping != Damping::none) {
      Matrix viscous = {};
      Lanes viscous_force[4][3];
      add_damping(g, drawn, v, k, viscous, viscous_force);
      if constexpr (has.damping == Damping::book) {
        forces_of(viscous, viscous_force, matter, k, corners);
        add_to_corners(chunk, block, corners, scratch.column + kDampingForce);
      }
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) stress.at[i][j] += viscous.at[i][j];
      for (int m = 0; m < 4; ++m)
        for (int i = 0; i < 3; ++i) mode_force[m][i] += viscous_force[m][i];
    }
    forces_of(stress, mode_force, matter, k, corners);
    add_to_corners(chunk, block, corners, scratch.column + kForce);
  }

 private:
  // First Piola-Kirchhoff stress [Pa]; `now` is set where fracture or the books need it. Chains that are drawn beyond
  // their length end the run as a cell does that folds.
  template <Composition has>
  FLEXEL_INLINE static Matrix elastic_stress(const Gradient& g, const CellConstants& k, const Lanes& fill,
                                             [[maybe_unused]] Elastic& now, Sums& sums) {
    if (k.law.name == LawName::neo_hooke) {
      const Lanes log_volume = log1p(g.change);
      if constexpr (has.fracture) now = elastic_state(g, g.change, log_volume);
      return laws::neo_hooke_stress(g, log_volume, k.mu, k.lambda);
    }
    const Gradient at = g;
    Matrix made;
    Lanes reserve = Lanes{} + __builtin_huge_val();
    stress_of_law(k.law, at, made, reserve);
    reserve = fill > 0 ? reserve : Lanes{} + __builtin_huge_val();
    sums.smallest_jacobian = reserve >= sums.smallest_jacobian ? sums.smallest_jacobian : reserve;
    if constexpr (has.fracture || has.plasticity) now = elastic_state(g, g.change, Lanes{});
    return made;
  }

  // Of a whole cell of another law than neo-Hooke's [J].
  FLEXEL_INLINE static Lanes energy_by_law(const Gradient& g, const Elastic& now, const CellConstants& k) {
    const Matrix h = g.h;
    Lanes density;
    energy_of_law(k.law, h, density);
    return k.volume * (density + 0.5 * now.hourglass_square);
  }

  // Of cells that break with the force f [J]: their energy half a step ago, U + dt/2 f . v, which is what the
  // books of the leapfrog lose when a force of this step is taken away.
  FLEXEL_INLINE static Lanes released_energy(const Matrix& stress, const Lanes mode_force[4][3],
                                             const Lanes& energy, const Lanes& lost, const CellConstants& k,
                                             const Advance& advance, const Corners& velocity) {
    Corners force;
    forces_of(stress, mode_force, lost, k, force);
    Lanes power = {};
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) power += force.at[a][c] * velocity.at[a][c];
    const Lanes released = lost * energy + 0.5 * advance.kick * power;
    return lost > 0 ? released : Lanes{};
  }
};

// Cell by cell, or the model's own way.
template <class Model, Composition has>
FLEXEL_INLINE void add_forces(const ChunkView& chunk, const Advance& advance, const Scratch& scratch,
                              Sums& sums) {
  const int columns = has.damping == Damping::book ? 6 : 3;
  for (int c = 0; c < columns; ++c)
    __builtin_memset(scratch.column[kForce + c], 0, chunk.count * sizeof(double));
  for (std::size_t b = 0; b < chunk.block_count; ++b)
    Model::template add_block<has>(chunk, b, advance, scratch, sums);
}

template <class Model, Composition has>
ChunkOutcome run(const ChunkView& chunk, const StateView& state, const Advance& advance, double* memory) {
  Scratch scratch;
  const std::size_t stride = scratch.stride = scratch_stride(chunk.count);
  for (std::size_t c = 0; c < kScratchColumns; ++c) scratch.column[c] = memory + kLanes + c * stride;
  read_elements<has.damping>(chunk, state, scratch);
  Sums sums;
  if constexpr (Model::by_connection) {
    Model::template add_forces<has.damping>(chunk, scratch, sums);
  } else {
    add_forces<Model, has>(chunk, advance, scratch, sums);
  }
  ChunkOutcome outcome = {};
  advance_owned<has.damping>(chunk, state, advance, scratch);
  hand_over_shared(chunk, scratch.column + kForce, chunk.shared_force);
  if constexpr (has.damping == Damping::book)
    hand_over_shared(chunk, scratch.column + kDampingForce, chunk.shared_damping);
  outcome.smallest_jacobian = __builtin_huge_val();
  for (std::size_t l = 0; l < kLanes; ++l) {
    const double value = sums.smallest_jacobian[l];
    if (!(value >= outcome.smallest_jacobian))
      outcome.smallest_jacobian = value != value ? -__builtin_huge_val() : value;
  }
  if constexpr (has.fracture || has.plasticity || Model::by_connection) {
    outcome.elastic = sum(sums.elastic);
    outcome.plastic_work = sum(sums.plastic_work);
    outcome.released = sum(sums.released);
    outcome.broken = sums.broken;
  }
  return outcome;
}

template <class Model, bool plasticity, bool fracture>
void fill_in(ChunkKernel* to) {
  constexpr Composition none{Damping::none, plasticity, fracture},
      plain{Damping::plain, plasticity, fracture}, book{Damping::book, plasticity, fracture};
  to[variant_number(none)] = &run<Model, none>;
  to[variant_number(plain)] = &run<Model, plain>;
  to[variant_number(book)] = &run<Model, book>;
}

template <class Model, class Plain = Model>
void fill_in(ChunkKernel* to) {
  fill_in<Plain, false, false>(to);
  fill_in<Model, true, false>(to);
  fill_in<Model, false, true>(to);
  fill_in<Model, true, true>(to);
}

}  // namespace

#define FLEXEL_JOIN(a, b) a##b
#define FLEXEL_TABLE(isa) FLEXEL_JOIN(kernels_, isa)
#define FLEXEL_TEXT(isa) #isa
#define FLEXEL_NAME(isa) FLEXEL_TEXT(isa)

const KernelTable& FLEXEL_TABLE(FLEXEL_ISA)() {
  static const KernelTable table = [] {
    KernelTable made{FLEXEL_NAME(FLEXEL_ISA), {}, {}};
    fill_in<CellsModel>(made.cells);
    fill_in<SpringsModel, ConnectionsModel>(made.springs);
    return made;
  }();
  return table;
}

}  // namespace flexel::simulate::step
