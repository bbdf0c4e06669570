// One chunk of a product with the tangent stiffness: gather the displacements of its elements, sum the forces
// of its cells eight at a time, hand them over. The formulas are those of simulate/kernels/kernel_table.cpp made
// linear: H from the transform of the corners, dP of it, the transform backwards.
#include "simulate/kernels/kernel_product.h"

#include "simulate/kernels/kernel_cells.h"
#include "simulate/kernels/kernel_elements.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::simulate::step {
namespace {

FLEXEL_INLINE Matrix stress_at_rest(const Matrix& h, const CellConstants& k) {
  if (k.law.name == LawName::orthotropic) {
    Matrix strain, made;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) strain.at[i][j] = 0.5 * (h.at[i][j] + h.at[j][i]);
    stress_at_rest_of_law(k.law, strain, made);
    return made;
  }
  const Lanes pressure = k.lambda * (h.at[0][0] + h.at[1][1] + h.at[2][2]);
  Matrix p;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) p.at[i][j] = k.mu * (h.at[i][j] + h.at[j][i]) + (i == j ? pressure : Lanes{});
  return p;
}

FLEXEL_INLINE Matrix load_matrix(const double* from) {
  Matrix g;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) g.at[i][j] = load(from + kLanes * static_cast<std::size_t>(3 * i + j));
  return g;
}

FLEXEL_INLINE Matrix stress_deformed(const Matrix& h, const Matrix& g, const double* tangent,
                                     const CellConstants& k) {
  const Lanes coupling = load(tangent);
  Lanes added[6];
  for (std::size_t c = 0; c < 6; ++c) added[c] = load(tangent + kLanes * (1 + c));
  constexpr int of[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  Matrix turned;  // c H^T G
  Lanes change = {};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      turned.at[i][j] =
          coupling * (h.at[0][i] * g.at[0][j] + h.at[1][i] * g.at[1][j] + h.at[2][i] * g.at[2][j]);
      change += h.at[i][j] * g.at[i][j];
    }
  change *= k.lambda;
  Matrix p;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      p.at[i][j] =
          k.mu * h.at[i][j] + change * g.at[i][j] +
          (g.at[i][0] * turned.at[0][j] + g.at[i][1] * turned.at[1][j] + g.at[i][2] * turned.at[2][j]) +
          (h.at[i][0] * added[of[0][j]] + h.at[i][1] * added[of[1][j]] + h.at[i][2] * added[of[2][j]]);
  return p;
}

FLEXEL_INLINE Matrix stress_by_moduli(const Matrix& h, const double* tangent) {
  Matrix p;
  for (int row = 0; row < 9; ++row) {
    Lanes sum = {};
    for (int column = 0; column < 9; ++column)
      sum +=
          load(tangent + kLanes * static_cast<std::size_t>(9 * row + column)) * h.at[column / 3][column % 3];
    p.at[row / 3][row % 3] = sum;
  }
  return p;
}

// Adds what the hourglass energy by K changes: of s = J K p, forces r_m = G s_m, stress U G - sum r_m p_m^T with U =
// 1/2 p s,
//     dp_m = G^T (dQ_m - H p_m),   dr_m = G (J K dp - H^T r)_m + (G : H) r_m,   dU = (G : H) U + s dp.
FLEXEL_INLINE void add_by_mode(const Matrix& h, const Matrix& g, const double* tangent, const Modes u[3],
                               const CellConstants& k, Matrix& stress, Lanes mode_force[4][3]) {
  const Lanes jacobian = load(tangent + kLanes * 18), share = jacobian * load(tangent + kLanes * 19);
  Lanes p[3][3], s[3][3], r[3][3], dp[3][3], ds[3][3], swells = {}, energy = {}, change = {};
  for (int m = 0; m < 3; ++m)
    for (int i = 0; i < 3; ++i)
      p[m][i] = 8 * load(tangent + kLanes * static_cast<std::size_t>(9 + 3 * m + i));
  forces_by_mode(k, p, s);
  for (int m = 0; m < 3; ++m) {
    Lanes moved[3];
    multiply(h, p[m], moved);
    for (int i = 0; i < 3; ++i) moved[i] = u[i].q[m] - moved[i];
    multiply_transposed(g, moved, dp[m]);
    for (int i = 0; i < 3; ++i) {
      s[m][i] = share * s[m][i];
      swells += g.at[m][i] * h.at[m][i];
      energy += 0.5 * p[m][i] * s[m][i];
      change += s[m][i] * dp[m][i];
    }
    multiply(g, s[m], r[m]);
  }
  change += swells * energy;
  forces_by_mode(k, dp, ds);
  for (int m = 0; m < 3; ++m) {
    Lanes turned[3], dr[3];
    multiply_transposed(h, r[m], turned);
    for (int i = 0; i < 3; ++i) turned[i] = jacobian * ds[m][i] - turned[i];
    multiply(g, turned, dr);
    for (int i = 0; i < 3; ++i) {
      dr[i] += swells * r[m][i];
      mode_force[m][i] += dr[i];
      for (int j = 0; j < 3; ++j) stress.at[i][j] -= dr[i] * p[m][j] + r[m][i] * dp[m][j];
    }
  }
  for (int i = 0; i < 3; ++i) {  // dG = -G H^T G
    Lanes across[3], row[3];
    for (int j = 0; j < 3; ++j)
      across[j] = g.at[i][0] * h.at[j][0] + g.at[i][1] * h.at[j][1] + g.at[i][2] * h.at[j][2];
    multiply_transposed(g, across, row);
    for (int j = 0; j < 3; ++j) stress.at[i][j] += change * g.at[i][j] - energy * row[j];
  }
}

template <TangentForm form>
FLEXEL_INLINE void add_block(const ChunkView& chunk, const CellBlock& block, const double* tangent,
                             const Scratch& scratch) {
  const CellConstants& k = *chunk.constants;
  Corners corners;
  read_corners(chunk, block, scratch.column + kDisplacement, corners);
  Modes u[3];
  for (int i = 0; i < 3; ++i) u[i] = transform(corners, i);
  Matrix h, stress;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) h.at[i][j] = u[i].d[j] * (0.25 / k.spacing[j]);
  Lanes mode_force[4][3];
  [[maybe_unused]] Lanes q[3][3];
  for (int m = 0; m < 4; ++m)
    for (int i = 0; i < 3; ++i) {
      if (m < 3) q[m][i] = u[i].q[m];
      mode_force[m][i] = k.hourglass[m] * u[i].q[m];
    }
  if constexpr (form == TangentForm::at_rest) {
    stress = stress_at_rest(h, k);
    Lanes s[3][3];
    forces_by_mode(k, q, s);
    for (int m = 0; m < 3; ++m)
      for (int i = 0; i < 3; ++i) mode_force[m][i] += s[m][i];
  } else {
    const Matrix g = load_matrix(tangent);
    const double* mean = tangent + kLanes * kHourglassColumns;
    if constexpr (form == TangentForm::deformed)
      stress = stress_deformed(h, g, mean, k);
    else
      stress = stress_by_moduli(h, mean);
    add_by_mode(h, g, tangent, u, k, stress, mode_force);
  }
  forces_of(stress, mode_force, -load(block.fill), k, corners);  // K u: against the forces
  add_to_corners(chunk, block, corners, scratch.column + kForce);
}

void write_owned(const ChunkView& chunk, const Scratch& scratch, double* y) {
  const CellConstants& k = *chunk.constants;
  for (std::size_t o = 0; o < chunk.owned_count;) {
    const std::size_t l = chunk.owned[o];
    double* to = y + 3 * static_cast<std::size_t>(chunk.elements[l]);
    if (is_row(chunk.owned, o, chunk.owned_count) && is_row(chunk.elements, l, chunk.count)) {
      const Triple<Lanes> force = row_of(k, scratch.column + kForce, l);
      for (std::size_t c = 0; c < 3; ++c) store(to + c * kLanes, force.at[c]);
      o += kLanes;
    } else {
      const Triple<double> force = one_of(k, scratch.column + kForce, l);
      for (int c = 0; c < 3; ++c) to[c] = force.at[c];
      ++o;
    }
  }
}

template <TangentForm form>
void run(const ChunkView& chunk, const double* tangent, const double* x, double* y, double* memory) {
  Scratch scratch = {};
  const std::size_t stride = scratch.stride = scratch_stride(chunk.count);
  for (std::size_t c = 0; c < 3; ++c) {
    scratch.column[kDisplacement + c] = memory + kLanes + c * stride;
    scratch.column[kForce + c] = memory + kLanes + (3 + c) * stride;
    __builtin_memset(scratch.column[kForce + c], 0, chunk.count * sizeof(double));
  }
  StateView state = {};
  state.displacement = const_cast<double*>(x);  // only read
  read_elements<Damping::none>(chunk, state, scratch);
  constexpr std::size_t columns = kTangentColumns[static_cast<std::size_t>(form)];
  for (std::size_t b = 0; b < chunk.block_count; ++b)
    add_block<form>(chunk, chunk.blocks[b], tangent + kLanes * columns * b, scratch);
  write_owned(chunk, scratch, y);
  hand_over_shared(chunk, scratch.column + kForce, chunk.shared_force);
}

}  // namespace

#define FLEXEL_JOIN(a, b) a##b
#define FLEXEL_TABLE(isa) FLEXEL_JOIN(products_, isa)

const ProductTable& FLEXEL_TABLE(FLEXEL_ISA)() {
  static constexpr ProductTable table = {
      {&run<TangentForm::at_rest>, &run<TangentForm::deformed>, &run<TangentForm::moduli>}};
  return table;
}

}  // namespace flexel::simulate::step
