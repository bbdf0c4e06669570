// Plastic flow and fracture of model `cells`, eight cells at a time. Included by kernel_table.cpp alone.
//
// J2 flow with the split F = Fe Fp (Simo and Hughes 1998, section 9.3 and box 9.1). What a cell remembers is
// Cp^-1 and the equivalent plastic strain a. With b = F Cp^-1 F^T, the energy of the cell is W of b in place
// of F F^T, so the Kirchhoff stress is tau = mu (b - I) + lambda ln J I, its deviator s = mu dev b, and
//     |s| <= sqrt(2/3) sigma_y(a)
// is kept by shrinking s, with the slope of sigma_y at the a before the step: exact where it is linear, and elsewhere
// right to the square of what flows in a step, which does not add up, for the next step begins at sigma_y of its own a. The trace of b follows from det b = J^2 (plastic flow keeps the volume): Newton on
// the cubic det(s/mu + x I) = J^2. Then P = tau F^-T.
//
// A cell whose rest shape is another than the voxel's (docs/reference/events.md) has Fp with Jp = det Fp other than 1:
// J is then over Jp, in everything but F^-T, and energies and stresses are per volume of the rest shape, Jp
// to one of the voxel.
//
// The hourglass displacements q_m have a plastic part F Q_m, which turns with the cell: energy U_h of e_m = q_m - F Q_m
// and p_m = F^-1 e_m. Their stress at a cell's faces, beside the mean one, S^2 = 12 mu U_h / V, is bounded as the bending
// moment of a rectangular section under tension is (Prager and Hodge 1951,
// M / Mp = 1 - (N / Np)^2, Mp = 3/2 My), but not below 1/20 of the yield stress, which keeps cells that yield
// from swinging in these modes:
//     S / S_y <= max(3/2 (1 - |s|^2 / S_y^2), 1/20),   S_y = sqrt(2/3) sigma_y(a)
//
// A cell breaks when the largest principal Cauchy stress passes `strength`: when `strength` I - tau / J is no
// longer positive definite (Sylvester's minors); or when a passes `elongation`.
#pragma once
#include "simulate/kernels/kernel_cells.h"

namespace flexel::simulate::step {
namespace {

constexpr double kRootTwoThirds = 0.8164965809277260;
constexpr double kHourglassFloor = 0.05;  // of the yield stress

// Symmetric matrix: xx, yy, zz, xy, yz, zx.
struct Symmetric {
  Lanes at[6];
};
constexpr int kEntry[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

FLEXEL_INLINE bool any(const LaneMask& mask) {
  long long bits = 0;
  for (std::size_t l = 0; l < kLanes; ++l) bits |= mask[l];
  return bits != 0;
}

// M S M^T
FLEXEL_INLINE Symmetric congruence(const Matrix& m, const Symmetric& s) {
  Matrix t;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      t.at[i][j] =
          m.at[i][0] * s.at[kEntry[0][j]] + m.at[i][1] * s.at[kEntry[1][j]] + m.at[i][2] * s.at[kEntry[2][j]];
  Symmetric r;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      r.at[kEntry[i][j]] = t.at[i][0] * m.at[j][0] + t.at[i][1] * m.at[j][1] + t.at[i][2] * m.at[j][2];
  return r;
}

// F F^T - I
FLEXEL_INLINE Symmetric left_strain(const Matrix& h) {
  Symmetric b;
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      b.at[kEntry[i][j]] = h.at[i][j] + h.at[j][i] +
                           (h.at[i][0] * h.at[j][0] + h.at[i][1] * h.at[j][1] + h.at[i][2] * h.at[j][2]);
  return b;
}

FLEXEL_INLINE Lanes square(const Symmetric& s) {
  return s.at[0] * s.at[0] + s.at[1] * s.at[1] + s.at[2] * s.at[2] +
         2 * (s.at[3] * s.at[3] + s.at[4] * s.at[4] + s.at[5] * s.at[5]);
}

FLEXEL_INLINE Lanes determinant(const Symmetric& s) {
  return s.at[0] * (s.at[1] * s.at[2] - s.at[4] * s.at[4]) -
         s.at[3] * (s.at[3] * s.at[2] - s.at[4] * s.at[5]) +
         s.at[5] * (s.at[3] * s.at[4] - s.at[1] * s.at[5]);
}

// The state of the material in a block.
struct Elastic {
  Symmetric strain;  // b - I
  Lanes trace;       // tr(b - I)
  Lanes change;      // J - 1, J over that of the rest shape
  Lanes log_volume;  // ln J
  // With plasticity, of sums: 8 e_m [m], p_m of the first three [m], their forces [Pa/m] and of these the part by K.
  Lanes hourglass[4][3], drawn[3][3], mode_force[4][3], by_mode[3][3];
  Lanes hourglass_square;  // 2 U_h / V [Pa]
};

FLEXEL_INLINE Symmetric deviator(const Symmetric& s, const Lanes& trace) {
  Symmetric d = s;
  for (int i = 0; i < 3; ++i) d.at[i] = s.at[i] - trace * (1.0 / 3);
  return d;
}

// 2 U_h / V, which is of second order.
FLEXEL_INLINE Lanes hourglass_square(const Modes u[3], const Lanes mode_force[4][3]) {
  Lanes sum = {};
  for (int m = 0; m < 4; ++m)
    for (int i = 0; i < 3; ++i) sum += u[i].q[m] * mode_force[m][i];
  return sum;
}

// Without the hourglass displacements.
FLEXEL_INLINE Elastic elastic_state(const Gradient& g, const Lanes& change, const Lanes& log_volume) {
  Elastic now;
  now.change = change;
  now.log_volume = log_volume;
  now.strain = left_strain(g.h);
  now.trace = now.strain.at[0] + now.strain.at[1] + now.strain.at[2];
  return now;
}

FLEXEL_INLINE Matrix deformation(const Gradient& g) {
  Matrix f = g.h;
  for (int i = 0; i < 3; ++i) f.at[i][i] += 1;
  return f;
}

FLEXEL_INLINE Matrix inverse_of(const Gradient& g) {
  Matrix r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.at[i][j] = g.inverse * g.cofactor.at[j][i];
  return r;
}

// e_m = q_m - F Q_m and what follows from them.
FLEXEL_INLINE void set_hourglass(const Gradient& g, const Modes u[3], const CellConstants& k,
                                 const PlasticBlock& memory, Elastic& now) {
  const Matrix f = deformation(g), back = inverse_of(g);
  for (int m = 0; m < 4; ++m) {
    const Lanes q[3] = {8 * load(memory.hourglass[m][0]), 8 * load(memory.hourglass[m][1]),
                        8 * load(memory.hourglass[m][2])};
    multiply(f, q, now.hourglass[m]);
    for (int i = 0; i < 3; ++i) now.hourglass[m][i] = u[i].q[m] - now.hourglass[m][i];
    if (m < 3) multiply(back, now.hourglass[m], now.drawn[m]);
  }
  Lanes s[3][3];
  forces_by_mode(k, now.drawn, s);
  for (int m = 0; m < 4; ++m) {
    if (m < 3) {
      for (int i = 0; i < 3; ++i) s[m][i] = (1 + now.change) * s[m][i];
      multiply_transposed(back, s[m], now.by_mode[m]);
    }
    for (int i = 0; i < 3; ++i) {
      now.mode_force[m][i] = k.hourglass[m] * now.hourglass[m][i];
      if (m < 3) now.mode_force[m][i] += now.by_mode[m][i];
    }
  }
  now.hourglass_square = Lanes{};
  for (int m = 0; m < 4; ++m)
    for (int i = 0; i < 3; ++i) now.hourglass_square += now.hourglass[m][i] * now.mode_force[m][i];
}

// What the flow of the mean stress leaves for the hourglass modes: |s| and its bound [Pa].
struct Yielding {
  Lanes stress, bound;
};

FLEXEL_INLINE Yielding flow(const Gradient& g, const CellConstants& k, const Lanes& fill, Elastic& now,
                            PlasticBlock& memory, Sums& sums) {
  Lanes plastic = load(memory.strain);
  Symmetric d = deviator(now.strain, now.trace);
  const Lanes dd = square(d);
  Yielding y;
  y.stress = k.mu * square_root(dd);
  const FlowStress yield = flow_stress(k, plastic);
  y.bound = kRootTwoThirds * yield.stress;
  const LaneMask yields = (y.stress > y.bound) & (fill > 0);
  if (!any(yields)) return y;
  const Lanes elastic = k.mu * (1 + now.trace * (1.0 / 3));  // mu tr b / 3
  const Lanes multiplier = yields ? (y.stress - y.bound) / (2 * elastic + 2.0 / 3 * yield.slope) : Lanes{};
  const Lanes shrink = yields ? 1 - 2 * elastic * multiplier / y.stress : Lanes{} + 1;
  const Lanes third = determinant(d) * shrink * shrink * shrink, second = 0.5 * dd * shrink * shrink;
  const Lanes wanted = now.change * (2 + now.change);  // J^2 - 1
  Lanes w = now.trace * (1.0 / 3);
  for (int i = 0; i < 3; ++i) {
    const Lanes value = w * (3 + w * (3 + w)) - second * (1 + w) + third - wanted;
    w -= value / (3 * (1 + w) * (1 + w) - second);
  }
  Symmetric change;
  for (int i = 0; i < 6; ++i) {
    Lanes to = shrink * d.at[i];
    if (i < 3) to += w;
    change.at[i] = yields ? to - now.strain.at[i] : Lanes{};
    now.strain.at[i] = yields ? to : now.strain.at[i];
  }
  const Symmetric back = congruence(inverse_of(g), change);
  for (int i = 0; i < 6; ++i) store(memory.flow[i], load(memory.flow[i]) + (yields ? back.at[i] : Lanes{}));
  plastic += kRootTwoThirds * multiplier;
  store(memory.strain, plastic);
  const Lanes reached = y.stress * shrink;
  // The energy that the return takes, at the mean stress of the step instead of the trial's.
  const Lanes taken = 0.5 * k.mu * (now.trace - 3 * w) * (y.bound + reached) / (y.stress + reached);
  sums.plastic_work += yields ? fill * k.volume * taken : Lanes{};
  now.trace = yields ? 3 * w : now.trace;
  y.bound = yields ? reached : y.bound;
  y.stress = yields ? reached : y.stress;
  return y;
}

FLEXEL_INLINE void flow_of_hourglass(const Gradient& g, const CellConstants& k, const Lanes& fill,
                                     const Yielding& y, Elastic& now, PlasticBlock& memory, Sums& sums) {
  const Lanes stress = square_root(6 * k.mu * now.hourglass_square);
  const Lanes ratio = y.stress / y.bound;
  const Lanes bending = 1.5 * (1 - ratio * ratio);
  const Lanes bound = y.bound * (bending > kHourglassFloor ? bending : Lanes{} + kHourglassFloor);
  const LaneMask yields = (stress > bound) & (fill > 0);
  if (!any(yields)) return;
  const Lanes keep = yields ? bound / stress : Lanes{} + 1;
  sums.plastic_work += fill * k.volume * now.hourglass_square * (1 - keep) * keep;
  const Matrix back = inverse_of(g);
  for (int m = 0; m < 4; ++m) {
    Lanes taken[3];
    for (int i = 0; i < 3; ++i) {
      taken[i] = 0.125 * (1 - keep) * now.hourglass[m][i];
      now.hourglass[m][i] = keep * now.hourglass[m][i];
      now.mode_force[m][i] = keep * now.mode_force[m][i];
      if (m < 3) {
        now.drawn[m][i] = keep * now.drawn[m][i];
        now.by_mode[m][i] = keep * now.by_mode[m][i];
      }
    }
    for (int i = 0; i < 3; ++i) {
      const Lanes moved = back.at[i][0] * taken[0] + back.at[i][1] * taken[1] + back.at[i][2] * taken[2];
      store(memory.hourglass[m][i], load(memory.hourglass[m][i]) + (yields ? moved : Lanes{}));
    }
  }
  now.hourglass_square *= keep * keep;
}

// The state less what has flowed, flowing on where it yields.
FLEXEL_INLINE Elastic plastic_state(const Gradient& g, const Modes u[3], const CellConstants& k,
                                    const Lanes& fill, PlasticBlock& memory, Sums& sums) {
  const Lanes rest = load(memory.volume), change = (g.change - rest) / (1 + rest);
  Elastic now = elastic_state(g, change, log1p(change));
  Symmetric flowed;
  for (int i = 0; i < 6; ++i) flowed.at[i] = load(memory.flow[i]);
  flowed = congruence(deformation(g), flowed);
  for (int i = 0; i < 6; ++i) now.strain.at[i] += flowed.at[i];
  now.trace = now.strain.at[0] + now.strain.at[1] + now.strain.at[2];
  set_hourglass(g, u, k, memory, now);
  const Yielding y = flow(g, k, fill, now, memory, sums);
  flow_of_hourglass(g, k, fill, y, now, memory, sums);
  return now;
}

// First Piola-Kirchhoff stress of the mean and, through F Q_m and F^-1 e_m, of the hourglass modes [Pa].
FLEXEL_INLINE Matrix plastic_stress(const Gradient& g, const Elastic& now, const CellConstants& k,
                                    const PlasticBlock& memory) {
  const Lanes pressure = k.lambda * now.log_volume;
  Lanes by_mode = {};  // energy by K over V
  for (int m = 0; m < 3; ++m)
    for (int i = 0; i < 3; ++i) by_mode += 0.5 * now.by_mode[m][i] * now.hourglass[m][i];
  Matrix p;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      Lanes sum = (pressure + by_mode) * g.cofactor.at[i][j];
      for (int n = 0; n < 3; ++n) sum += k.mu * now.strain.at[kEntry[i][n]] * g.cofactor.at[n][j];
      p.at[i][j] = sum * g.inverse;
    }
  for (int m = 0; m < 4; ++m)
    for (int j = 0; j < 3; ++j) {
      const Lanes q = 8 * load(memory.hourglass[m][j]);
      for (int i = 0; i < 3; ++i) {
        p.at[i][j] -= now.mode_force[m][i] * q;
        if (m < 3) p.at[i][j] -= now.by_mode[m][i] * now.drawn[m][j];
      }
    }
  return p;
}

// Elastic energy [J] of whole cells.
FLEXEL_INLINE Lanes elastic_energy(const Elastic& now, const CellConstants& k) {
  return k.volume * (0.5 * k.mu * (now.trace - 2 * now.log_volume) +
                     0.5 * k.lambda * now.log_volume * now.log_volume + 0.5 * now.hourglass_square);
}

// Lanes that break.
FLEXEL_INLINE LaneMask breaks(const Elastic& now, const CellConstants& k, const Lanes& fill) {
  const Lanes limit = k.strength * (1 + now.change), pressure = k.lambda * now.log_volume;
  const Symmetric d = deviator(now.strain, now.trace);
  // No principal value of a deviator passes sqrt(2/3) of its norm.
  const Lanes most =
      k.mu * (now.trace * (1.0 / 3) + kRootTwoThirds * square_root(square(d))) * (1 + 1e-12) + pressure;
  LaneMask broken = (most > limit) & (fill > 0);
  if (!any(broken)) return broken;
  Symmetric left;
  for (int i = 0; i < 6; ++i) left.at[i] = -k.mu * now.strain.at[i] + (i < 3 ? limit - pressure : Lanes{});
  const Lanes minor = left.at[0] * left.at[1] - left.at[3] * left.at[3];
  broken &= ~((left.at[0] > 0) & (minor > 0) & (determinant(left) > 0));
  return broken;
}

}  // namespace
}  // namespace flexel::simulate::step
