// One chunk of one step: gather the state of its elements, sum the forces of its cells eight at a time,
// advance the elements that are its own. Compiled once per instruction set (FLEXEL_ISA); contraction is off,
// so the bits agree between them.
//
// Model `cells` (simulate/cell_model.h) in the lattice frame. With the sums D_j = sum_a s_aj u_a and Q_m =
// sum_a s_ma u_a of an 8-point Walsh-Hadamard transform,
//     H_.j = D_j / (4 h_j),  q_m = Q_m / 8,
//     f_a = -fill { V/4 sum_j P_.j s_aj / h_j + 1/8 sum_m c_m s_ma q_m }:  the same transform backwards.
// P = mu (F - F^-T) + lambda ln J F^-T without cancellation, with F = I + H and cof F = I + tr(H) I - H^T +
// cof H:
//     J (F - F^-T) = (J - 1 - tr H) I + J H + H^T - cof H.
//
// Damping with time tau is the power of the rate of strain: S_v = tau (lambda tr A I + 2 mu A), A = sym(F^T
// dF/dt), P_v = F S_v, and for the hourglass modes of their rate as seen by an observer that turns with the
// cell, q' = dq/dt
// - w x q, w the spin of dF/dt F^-1. The dissipation does not change under any rigid motion of the
// velocities, so linear and angular momentum are kept exactly.
//
// Model `springs` (simulate/spring_model.h): F = -k (d - l) along each spring, Jansson and Vergeest eqs. 15,
// 16, 18; d - l = (d^2 - l^2) / (d + l) with d^2 - l^2 from the displacements, without cancellation.
#include "simulate/time/kernel.h"

#include "simulate/time/lanes.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::step {
namespace {

struct Scratch {
  double* column[kScratchColumns];
};

struct Corners {
  Lanes at[8][3];
};

enum Column { kDisplacement = 0, kVelocity = 3, kForce = 6, kDampingForce = 9 };

FLEXEL_INLINE void read_corners(const CellBlock& block, double* const* column, Corners& corners) {
  if (block.is_run) {
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) corners.at[a][c] = load(column[c] + block.corner[a][0]);
  } else {
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) corners.at[a][c] = gather(column[c], block.corner[a]);
  }
}

FLEXEL_INLINE void add_to_corners(const CellBlock& block, const Corners& corners, double* const* column) {
  if (block.is_run) {
    // Corner a + 1 of a cell is corner a of the next one: both are added in one go.
    constexpr LaneBits one_on = {0, 8, 9, 10, 11, 12, 13, 14};
    for (int a = 0; a < 8; a += 2)
      for (int c = 0; c < 3; ++c) {
        double* row = column[c] + block.corner[a][0];
        const Lanes& next = corners.at[a + 1][c];
        store(row, load(row) + (corners.at[a][c] + __builtin_shuffle(Lanes{}, next, one_on)));
        row[8] += next[7];
      }
  } else {
    for (int a = 0; a < 8; ++a)
      for (int c = 0; c < 3; ++c) scatter_add(column[c], block.corner[a], corners.at[a][c]);
  }
}

// The transform of one component: gradient sums D_x, D_y, D_z and hourglass sums Q of xy, yz, zx, xyz.
struct Modes {
  Lanes d[3], q[4];
};

FLEXEL_INLINE Modes transform(const Corners& u, int c) {
  Lanes p[4], m[4];
  for (int yz = 0; yz < 4; ++yz) {
    p[yz] = u.at[2 * yz + 1][c] + u.at[2 * yz][c];
    m[yz] = u.at[2 * yz + 1][c] - u.at[2 * yz][c];
  }
  const Lanes across[2] = {p[1] - p[0], p[3] - p[2]}, twist[2] = {m[1] - m[0], m[3] - m[2]};
  const Lanes low = m[0] + m[1], high = m[2] + m[3];
  return {{low + high, across[0] + across[1], (p[2] + p[3]) - (p[0] + p[1])},
          {twist[0] + twist[1], across[1] - across[0], high - low, twist[1] - twist[0]}};
}

FLEXEL_INLINE void transform_back(const Modes& t, int c, Corners& f) {
  for (int z = 0; z < 2; ++z) {
    const Lanes y_even = z ? t.d[1] + t.q[1] : t.d[1] - t.q[1];
    const Lanes y_odd = z ? t.q[0] + t.q[3] : t.q[0] - t.q[3];
    const Lanes z_even = z ? t.d[2] : -t.d[2];
    const Lanes z_odd = z ? t.d[0] + t.q[2] : t.d[0] - t.q[2];
    for (int y = 0; y < 2; ++y) {
      const Lanes even = y ? z_even + y_even : z_even - y_even;
      const Lanes odd = y ? z_odd + y_odd : z_odd - y_odd;
      f.at[4 * z + 2 * y][c] = even - odd;
      f.at[4 * z + 2 * y + 1][c] = even + odd;
    }
  }
}

struct Matrix {
  Lanes at[3][3];
};

FLEXEL_INLINE Matrix cofactor(const Matrix& m) {
  Matrix c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      c.at[i][j] = m.at[i1][j1] * m.at[i2][j2] - m.at[i1][j2] * m.at[i2][j1];
    }
  return c;
}

// What the cells add up to while a chunk is computed.
struct Sums {
  Lanes smallest_jacobian = Lanes{} + __builtin_huge_val();
};

struct Gradient {
  Matrix h, cofactor, less_one;  // H; cof F; cof F - I without cancellation
  Lanes jacobian, inverse;       // J, 1 / J
  Lanes trace, change;           // tr H; J - 1
};

FLEXEL_INLINE Gradient gradient_of(const Modes modes[3], const CellConstants& k, const Lanes& fill,
                                   Sums& sums) {
  Gradient g;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) g.h.at[i][j] = modes[i].d[j] * (0.25 / k.spacing[j]);
  const Matrix& h = g.h;
  const Matrix second = cofactor(h);
  g.trace = h.at[0][0] + h.at[1][1] + h.at[2][2];
  const Lanes sum_of_minors = second.at[0][0] + second.at[1][1] + second.at[2][2];
  const Lanes determinant =
      h.at[0][0] * second.at[0][0] + h.at[0][1] * second.at[0][1] + h.at[0][2] * second.at[0][2];
  g.change = g.trace + sum_of_minors + determinant;
  const Lanes jacobian = 1 + g.change;
  const Lanes counted = fill > 0 ? jacobian : Lanes{} + __builtin_huge_val();
  // A jacobian that is not a number fails both comparisons and must win.
  sums.smallest_jacobian = counted >= sums.smallest_jacobian ? sums.smallest_jacobian : counted;
  // A cell that resists nothing may be folded: its numbers are not used, but they must stay finite.
  g.change = fill > 0 ? g.change : Lanes{};
  g.jacobian = 1 + g.change;
  g.inverse = 1 / g.jacobian;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      g.less_one.at[i][j] = second.at[i][j] - h.at[j][i] + (i == j ? g.trace : Lanes{});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) g.cofactor.at[i][j] = g.less_one.at[i][j] + (i == j ? 1.0 : 0.0);
  return g;
}

// First Piola-Kirchhoff stress [Pa].
FLEXEL_INLINE Matrix elastic_stress(const Gradient& g, const CellConstants& k) {
  const Lanes pressure = k.lambda * log1p(g.change) * g.inverse;
  const Lanes shear = k.mu * g.inverse;
  Matrix p;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      // J (F - F^-T), F^-T = cof F / J
      const Lanes difference =
          g.jacobian * g.h.at[i][j] - g.less_one.at[i][j] + (i == j ? g.change : Lanes{});
      p.at[i][j] = shear * difference + pressure * g.cofactor.at[i][j];
    }
  return p;
}

// Adds the viscous stress [Pa] to `stress`; sets `spin_free`, the forces of the hourglass modes [N].
FLEXEL_INLINE void add_damping(const Gradient& g, const Modes u[3], const Modes v[3], const CellConstants& k,
                               Matrix& stress, Lanes spin_free[4][3]) {
  Matrix rate, strain_rate;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rate.at[i][j] = v[i].d[j] * (0.25 / k.spacing[j]);
  // A = sym(F^T dF/dt), F^T dF/dt = dF/dt + H^T dF/dt
  Matrix product;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      product.at[i][j] = rate.at[i][j] + (g.h.at[0][i] * rate.at[0][j] + g.h.at[1][i] * rate.at[1][j] +
                                          g.h.at[2][i] * rate.at[2][j]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) strain_rate.at[i][j] = product.at[i][j] + product.at[j][i];  // 2 A
  const Lanes pressure =
      (0.5 * k.damping * k.lambda) * (strain_rate.at[0][0] + strain_rate.at[1][1] + strain_rate.at[2][2]);
  Matrix s;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      s.at[i][j] = (k.damping * k.mu) * strain_rate.at[i][j] + (i == j ? pressure : Lanes{});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      stress.at[i][j] +=
          s.at[i][j] + (g.h.at[i][0] * s.at[0][j] + g.h.at[i][1] * s.at[1][j] + g.h.at[i][2] * s.at[2][j]);
  // spin w of L = dF/dt F^-1, F^-1 = (cof F)^T / J
  Matrix l;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      l.at[i][j] = g.inverse * (rate.at[i][0] * g.cofactor.at[j][0] + rate.at[i][1] * g.cofactor.at[j][1] +
                                rate.at[i][2] * g.cofactor.at[j][2]);
  const Lanes w[3] = {0.5 * (l.at[2][1] - l.at[1][2]), 0.5 * (l.at[0][2] - l.at[2][0]),
                      0.5 * (l.at[1][0] - l.at[0][1])};
  Lanes torque[3] = {};  // sum_m tau c_m q_m x q'_m
  for (int m = 0; m < 4; ++m) {
    const Lanes q[3] = {0.125 * u[0].q[m], 0.125 * u[1].q[m], 0.125 * u[2].q[m]};
    const double viscosity = k.damping * k.hourglass[m];
    for (int i = 0; i < 3; ++i) {
      const int a = (i + 1) % 3, b = (i + 2) % 3;
      spin_free[m][i] = viscosity * (0.125 * v[i].q[m] - (w[a] * q[b] - w[b] * q[a]));
    }
    for (int i = 0; i < 3; ++i) {
      const int a = (i + 1) % 3, b = (i + 2) % 3;
      torque[i] += q[a] * spin_free[m][b] - q[b] * spin_free[m][a];
    }
  }
  // its reaction through w: P += G F^-T / V, G_ij = 1/2 eps_kij t_k
  const Lanes share = (0.5 / k.volume) * g.inverse;
  for (int j = 0; j < 3; ++j) {
    const Lanes x = g.cofactor.at[0][j], y = g.cofactor.at[1][j], z = g.cofactor.at[2][j];
    stress.at[0][j] += share * (torque[2] * y - torque[1] * z);
    stress.at[1][j] += share * (torque[0] * z - torque[2] * x);
    stress.at[2][j] += share * (torque[1] * x - torque[0] * y);
  }
}

FLEXEL_INLINE void forces_of(const Matrix& stress, const Lanes mode_force[4][3], const Lanes& fill,
                             const CellConstants& k, Corners& force) {
  for (int i = 0; i < 3; ++i) {
    Modes t;
    for (int j = 0; j < 3; ++j) t.d[j] = -fill * stress.at[i][j] * (0.25 * k.volume / k.spacing[j]);
    for (int m = 0; m < 4; ++m) t.q[m] = -fill * mode_force[m][i] * 0.125;
    transform_back(t, i, force);
  }
}

struct CellsModel {
  template <Damping damping>
  FLEXEL_INLINE static void add_block(const CellBlock& block, const CellConstants& k, const Scratch& scratch,
                                      Sums& sums) {
    const Lanes fill = load(block.fill);
    Corners corners;
    Modes u[3];
    read_corners(block, scratch.column + kDisplacement, corners);
    for (int i = 0; i < 3; ++i) u[i] = transform(corners, i);
    const Gradient g = gradient_of(u, k, fill, sums);
    Matrix stress = elastic_stress(g, k);
    Lanes mode_force[4][3];
    for (int m = 0; m < 4; ++m)
      for (int i = 0; i < 3; ++i) mode_force[m][i] = (0.125 * k.hourglass[m]) * u[i].q[m];
    if constexpr (damping != Damping::none) {
      Modes v[3];
      read_corners(block, scratch.column + kVelocity, corners);
      for (int i = 0; i < 3; ++i) v[i] = transform(corners, i);
      Matrix viscous = {};
      Lanes spin_free[4][3];
      add_damping(g, u, v, k, viscous, spin_free);
      if constexpr (damping == Damping::book) {
        forces_of(viscous, spin_free, fill, k, corners);
        add_to_corners(block, corners, scratch.column + kDampingForce);
      }
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) stress.at[i][j] += viscous.at[i][j];
      for (int m = 0; m < 4; ++m)
        for (int i = 0; i < 3; ++i) mode_force[m][i] += spin_free[m][i];
    }
    forces_of(stress, mode_force, fill, k, corners);
    add_to_corners(block, corners, scratch.column + kForce);
  }
};

struct SpringsModel {
  template <Damping damping>
  FLEXEL_INLINE static void add_block(const CellBlock& block, const CellConstants& k, const Scratch& scratch,
                                      Sums& sums) {
    const Lanes fill = load(block.fill);
    Corners u, v, force = {}, damped = {};
    read_corners(block, scratch.column + kDisplacement, u);
    if constexpr (damping != Damping::none) read_corners(block, scratch.column + kVelocity, v);
#pragma GCC unroll 8
    for (int a = 0; a < 8; ++a)
#pragma GCC unroll 8
      for (int b = a + 1; b < 8; ++b) {
        const int kind = __builtin_popcount(static_cast<unsigned>(a ^ b)) - 1;
        Lanes d[3], off = {}, square = {};
        double rest_square = 0;
        for (int c = 0; c < 3; ++c) {
          const double rest = (((b >> c) & 1) - ((a >> c) & 1)) * k.spacing[c];
          const Lanes moved = u.at[b][c] - u.at[a][c];
          d[c] = rest + moved;
          off += moved * (2 * rest + moved);  // d^2 - l^2
          square += d[c] * d[c];
          rest_square += rest * rest;
        }
        const double rest_length = __builtin_sqrt(rest_square);
        const Lanes length = square_root(square);
        const Lanes both = length * (length + rest_length);
        const Lanes stiffness = k.spring[kind] * fill;
        Lanes pull;  // force on a along d, over |d|
        if constexpr (damping == Damping::none) {
          pull = stiffness * off / both;
        } else {
          Lanes along = {};
          for (int c = 0; c < 3; ++c) along += (v.at[b][c] - v.at[a][c]) * d[c];
          const Lanes inverse = 1 / (both * square);
          const Lanes viscous = stiffness * (k.damping * along * (both * inverse));
          pull = stiffness * (off * (square * inverse)) + viscous;
          if constexpr (damping == Damping::book)
            for (int c = 0; c < 3; ++c) {
              damped.at[a][c] += viscous * d[c];
              damped.at[b][c] -= viscous * d[c];
            }
        }
        for (int c = 0; c < 3; ++c) {
          force.at[a][c] += pull * d[c];
          force.at[b][c] -= pull * d[c];
        }
      }
    // A length that is not a number makes the forces so; the first one tells.
    const Lanes told = fill > 0 ? 1 + 0 * force.at[0][0] : Lanes{} + __builtin_huge_val();
    sums.smallest_jacobian = told >= sums.smallest_jacobian ? sums.smallest_jacobian : told;
    if constexpr (damping == Damping::book) add_to_corners(block, damped, scratch.column + kDampingForce);
    add_to_corners(block, force, scratch.column + kForce);
  }
};

struct Triple {
  double at[3];
};

FLEXEL_INLINE Triple to_lattice(const CellConstants& k, const double* world) {
  if (k.aligned) return {{world[0], world[1], world[2]}};
  Triple out;
  for (int j = 0; j < 3; ++j)
    out.at[j] = k.axes[3 * j] * world[0] + k.axes[3 * j + 1] * world[1] + k.axes[3 * j + 2] * world[2];
  return out;
}

FLEXEL_INLINE Triple to_world(const CellConstants& k, double* const* column, std::size_t l) {
  const double x = column[0][l], y = column[1][l], z = column[2][l];
  if (k.aligned) return {{x, y, z}};
  Triple out;
  for (int i = 0; i < 3; ++i) out.at[i] = k.axes[i] * x + k.axes[3 + i] * y + k.axes[6 + i] * z;
  return out;
}

template <Damping damping>
void read_elements(const ChunkView& chunk, const StateView& state, const Scratch& scratch) {
  const CellConstants& k = *chunk.constants;
  for (std::size_t l = 0; l < chunk.count; ++l) {
    const std::size_t e = 3 * static_cast<std::size_t>(chunk.elements[l]);
    const Triple u = to_lattice(k, state.displacement + e);
    for (int c = 0; c < 3; ++c) scratch.column[kDisplacement + c][l] = u.at[c];
    if constexpr (damping != Damping::none) {
      const Triple v = to_lattice(k, state.velocity + e);
      for (int c = 0; c < 3; ++c) scratch.column[kVelocity + c][l] = v.at[c];
    }
  }
  const int columns = damping == Damping::book ? 6 : 3;
  for (int c = 0; c < columns; ++c)
    __builtin_memset(scratch.column[kForce + c], 0, chunk.count * sizeof(double));
}

template <Damping damping>
void advance_owned(const ChunkView& chunk, const StateView& state, const Advance& advance,
                   const Scratch& scratch) {
  const CellConstants& k = *chunk.constants;
  for (std::size_t o = 0; o < chunk.owned_count; ++o) {
    const std::size_t l = chunk.owned[o], e = chunk.elements[l];
    Triple force = to_world(k, scratch.column + kForce, l);
    double* u = state.displacement + 3 * e;
    double* v = state.velocity + 3 * e;
    const double gain = advance.kick * state.inverse_mass[e];
    for (int c = 0; c < 3; ++c) {
      if (state.outer) force.at[c] += state.outer[3 * e + c];
      const double before = v[c];
      v[c] = before + gain * force.at[c];
      u[c] += advance.drift * (advance.explicit_drift ? before : v[c]);
    }
    if constexpr (damping == Damping::book) {
      const Triple damped = to_world(k, scratch.column + kDampingForce, l);
      for (int c = 0; c < 3; ++c) state.damping_force[3 * e + c] = damped.at[c];
    }
  }
}

void hand_over_shared(const ChunkView& chunk, double* const* column, double* out) {
  for (std::size_t s = 0; s < chunk.shared_count; ++s) {
    const Triple force = to_world(*chunk.constants, column, chunk.shared[s]);
    for (int c = 0; c < 3; ++c) out[3 * s + c] = force.at[c];
  }
}

template <class Model, Damping damping>
ChunkOutcome run(const ChunkView& chunk, const StateView& state, const Advance& advance, double* memory) {
  Scratch scratch;
  const std::size_t stride = scratch_stride(chunk.count);
  for (std::size_t c = 0; c < kScratchColumns; ++c) scratch.column[c] = memory + c * stride;
  read_elements<damping>(chunk, state, scratch);
  Sums sums;
  for (std::size_t b = 0; b < chunk.block_count; ++b)
    Model::template add_block<damping>(chunk.blocks[b], *chunk.constants, scratch, sums);
  ChunkOutcome outcome;
  advance_owned<damping>(chunk, state, advance, scratch);
  hand_over_shared(chunk, scratch.column + kForce, chunk.shared_force);
  if constexpr (damping == Damping::book)
    hand_over_shared(chunk, scratch.column + kDampingForce, chunk.shared_damping);
  outcome.smallest_jacobian = __builtin_huge_val();
  for (std::size_t l = 0; l < kLanes; ++l) {
    const double value = sums.smallest_jacobian[l];
    if (!(value >= outcome.smallest_jacobian))
      outcome.smallest_jacobian = value != value ? -__builtin_huge_val() : value;
  }
  return outcome;
}

template <class Model>
constexpr ChunkKernel variant(Damping damping) {
  return damping == Damping::none    ? &run<Model, Damping::none>
         : damping == Damping::plain ? &run<Model, Damping::plain>
                                     : &run<Model, Damping::book>;
}

}  // namespace

#define FLEXEL_JOIN(a, b) a##b
#define FLEXEL_TABLE(isa) FLEXEL_JOIN(kernels_, isa)
#define FLEXEL_TEXT(isa) #isa
#define FLEXEL_NAME(isa) FLEXEL_TEXT(isa)

const KernelTable& FLEXEL_TABLE(FLEXEL_ISA)() {
  using enum Damping;
  static const KernelTable table = {
      FLEXEL_NAME(FLEXEL_ISA),
      {variant<CellsModel>(none), variant<CellsModel>(plain), variant<CellsModel>(book)},
      {variant<SpringsModel>(none), variant<SpringsModel>(plain), variant<SpringsModel>(book)}};
  return table;
}

}  // namespace flexel::step
