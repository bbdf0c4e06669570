// Model `cells`, elastic and damped, eight cells at a time; kernel_table.cpp has the formulas. Included by
// kernel_table.cpp alone.
#pragma once
#include "simulate/kernels/kernel_law.h"
#include "simulate/laws/neo_hooke.h"

namespace flexel::simulate::step {
namespace {

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

// s = K p of the modes xy, yz, zx. Of sums Q, K and c_m are per volume: forces dW/dQ [Pa/m].
FLEXEL_INLINE void forces_by_mode(const CellConstants& k, const Lanes p[3][3], Lanes s[3][3]) {
  for (int m = 0; m < 3; ++m)
    s[m][(m + 2) % 3] = k.twisting[m][0] * p[0][2] + k.twisting[m][1] * p[1][0] + k.twisting[m][2] * p[2][1];
  for (int j = 0; j < 3; ++j) {
    const int a = (j + 1) % 3, b = (j + 2) % 3;
    s[j][a] = k.bending[j][0] * p[j][a] + k.bending[j][1] * p[b][b];
    s[b][b] = k.bending[j][1] * p[j][a] + k.bending[j][2] * p[b][b];
  }
}

// M v, M^T v
FLEXEL_INLINE void multiply(const Matrix& m, const Lanes v[3], Lanes to[3]) {
  for (int i = 0; i < 3; ++i) to[i] = m.at[i][0] * v[0] + m.at[i][1] * v[1] + m.at[i][2] * v[2];
}
FLEXEL_INLINE void multiply_transposed(const Matrix& m, const Lanes v[3], Lanes to[3]) {
  for (int i = 0; i < 3; ++i) to[i] = m.at[0][i] * v[0] + m.at[1][i] * v[1] + m.at[2][i] * v[2];
}

// F^-T, and the sums Q drawn back, p_m = F^-1 Q_m [m].
struct Drawn {
  Matrix inverse_transpose;
  Lanes p[4][3];
};

template <int modes>
FLEXEL_INLINE Drawn drawn_back(const Gradient& g, const Modes u[3]) {
  Drawn drawn;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) drawn.inverse_transpose.at[i][j] = g.inverse * g.cofactor.at[i][j];
  for (int m = 0; m < modes; ++m) {
    const Lanes q[3] = {u[0].q[m], u[1].q[m], u[2].q[m]};
    multiply_transposed(drawn.inverse_transpose, q, drawn.p[m]);
  }
  return drawn;
}

// Adds the stress of the hourglass energy [Pa]; sets the forces of its modes [Pa/m].
FLEXEL_INLINE void add_hourglass(const Gradient& g, const Drawn& drawn, const Modes u[3],
                                 const CellConstants& k, Matrix& stress, Lanes mode_force[4][3]) {
  Lanes s[3][3], energy = {};
  forces_by_mode(k, drawn.p, s);
  for (int m = 0; m < 3; ++m) {
    Lanes r[3];
    multiply(g.cofactor, s[m], r);
    for (int i = 0; i < 3; ++i) {
      energy += drawn.p[m][i] * s[m][i];
      mode_force[m][i] = k.hourglass[m] * u[i].q[m] + r[i];
      for (int j = 0; j < 3; ++j) stress.at[i][j] -= r[i] * drawn.p[m][j];
    }
  }
  energy *= 0.5;
  for (int i = 0; i < 3; ++i) {
    mode_force[3][i] = k.hourglass[3] * u[i].q[3];
    for (int j = 0; j < 3; ++j) stress.at[i][j] += energy * g.cofactor.at[i][j];
  }
}

FLEXEL_INLINE Gradient gradient_of(const Modes modes[3], const CellConstants& k, const Lanes& fill,
                                   Sums& sums) {
  Matrix h;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) h.at[i][j] = modes[i].d[j] * (0.25 / k.spacing[j]);
  return laws::kinematics(
      h, [&](const Lanes& change) __attribute__((always_inline))->Lanes {
        const Lanes jacobian = 1 + change;
        const Lanes counted = fill > 0 ? jacobian : Lanes{} + __builtin_huge_val();
        // A jacobian that is not a number fails both comparisons and must win.
        sums.smallest_jacobian = counted >= sums.smallest_jacobian ? sums.smallest_jacobian : counted;
        // A cell that resists nothing may be folded: its numbers are not used, but they must stay finite.
        return fill > 0 ? change : Lanes{};
      });
}

// 2 A, A = sym(F^T dF/dt), F^T dF/dt = dF/dt + H^T dF/dt. `rate`: dF/dt.
FLEXEL_INLINE Matrix twice_strain_rate(const Gradient& g, const Matrix& rate) {
  Matrix product, sum;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      product.at[i][j] = rate.at[i][j] + (g.h.at[0][i] * rate.at[0][j] + g.h.at[1][i] * rate.at[1][j] +
                                          g.h.at[2][i] * rate.at[2][j]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum.at[i][j] = product.at[i][j] + product.at[j][i];
  return sum;
}

// Adds the viscous stress [Pa] of the rate of the volume. `rate`: dF/dt.
FLEXEL_INLINE void add_swelling(const Gradient& g, const Matrix& rate, const CellConstants& k,
                                Matrix& stress) {
  Lanes swelling = {};  // dJ/dt
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) swelling += g.cofactor.at[i][j] * rate.at[i][j];
  const Lanes pressure = (k.damping * (k.lambda + 2 * k.mu / 3)) * swelling;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) stress.at[i][j] += pressure * g.cofactor.at[i][j];
}

// Adds the viscous stress of the hourglass rates [Pa]; sets the forces of their modes [Pa/m]. `rate`: dF/dt.
FLEXEL_INLINE void add_hourglass_damping(const Drawn& drawn, const Modes v[3], const Matrix& rate,
                                         const CellConstants& k, Matrix& stress, Lanes mode_force[4][3]) {
  Lanes moved[4][3], changed[3][3], s[3][3];  // q', dp/dt
  for (int m = 0; m < 4; ++m) {
    multiply(rate, drawn.p[m], moved[m]);
    for (int i = 0; i < 3; ++i) moved[m][i] = v[i].q[m] - moved[m][i];
    if (m < 3) multiply_transposed(drawn.inverse_transpose, moved[m], changed[m]);
  }
  forces_by_mode(k, changed, s);
  for (int m = 0; m < 4; ++m) {
    Lanes r[3] = {};
    if (m < 3) multiply(drawn.inverse_transpose, s[m], r);
    for (int i = 0; i < 3; ++i) {
      const Lanes force = k.damping * (k.hourglass[m] * moved[m][i] + r[i]);
      mode_force[m][i] = force;
      for (int j = 0; j < 3; ++j) stress.at[i][j] -= force * drawn.p[m][j];
    }
  }
}

// Adds the viscous stress [Pa] to `stress`; sets the viscous forces of the hourglass modes [Pa/m].
FLEXEL_INLINE void add_damping(const Gradient& g, const Drawn& drawn, const Modes v[3],
                               const CellConstants& k, Matrix& stress, Lanes mode_force[4][3]) {
  Matrix rate;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) rate.at[i][j] = v[i].d[j] * (0.25 / k.spacing[j]);
  const Matrix strain_rate = twice_strain_rate(g, rate);
  const Lanes mean =
      (k.damping * k.mu / 3) * (strain_rate.at[0][0] + strain_rate.at[1][1] + strain_rate.at[2][2]);
  Matrix s;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      s.at[i][j] = (k.damping * k.mu) * strain_rate.at[i][j] - (i == j ? mean : Lanes{});
  if (k.law.name == LawName::orthotropic) {
    Matrix half, made;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) half.at[i][j] = (0.5 * k.damping) * strain_rate.at[i][j];
    stress_at_rest_of_law(k.law, half, made);
    s = made;
  } else {
    add_swelling(g, rate, k, stress);
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      stress.at[i][j] +=
          s.at[i][j] + (g.h.at[i][0] * s.at[0][j] + g.h.at[i][1] * s.at[1][j] + g.h.at[i][2] * s.at[2][j]);
  add_hourglass_damping(drawn, v, rate, k, stress, mode_force);
}

FLEXEL_INLINE void forces_of(const Matrix& stress, const Lanes mode_force[4][3], const Lanes& fill,
                             const CellConstants& k, Corners& force) {
  Lanes along[3];
  for (int j = 0; j < 3; ++j) along[j] = (-0.25 * k.volume / k.spacing[j]) * fill;
  const Lanes whole = -k.volume * fill;
  for (int i = 0; i < 3; ++i) {
    Modes t;
    for (int j = 0; j < 3; ++j) t.d[j] = along[j] * stress.at[i][j];
    for (int m = 0; m < 4; ++m) t.q[m] = whole * mode_force[m][i];
    transform_back(t, i, force);
  }
}

}  // namespace
}  // namespace flexel::simulate::step
