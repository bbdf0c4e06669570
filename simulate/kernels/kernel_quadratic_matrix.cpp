// A cell's matrix is made of int d_j N_a d_l N_b, whose integrands are products of functions of one coordinate each: the sum
// over the points goes axis by axis, with all pairs of shape functions of that axis at once (sum factorization for matrices;
// Antolin, Buffa, Calabro, Martinelli and Sangalli, Comput. Methods Appl. Mech. Eng. 285, 2015).
#include "simulate/kernels/kernel_quadratic_matrix.h"

#include "simulate/kernels/quadratic_vectors.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::simulate::quadratic_kernel {
namespace {

static_assert(kSideBySide == kWidth);

using V = VectorOf<double>::Type;
constexpr std::size_t kAxisPoints = 5, kPlanePoints = kAxisPoints * kAxisPoints;

constexpr std::size_t unordered(std::size_t a, std::size_t b) {
  return a >= b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a;
}

// Products of two of `n` shape functions along an axis, t from -1 to 1, at Gauss's points: of values and slopes by t.
template <std::size_t n>
struct Products {
  static constexpr std::size_t kEven = n * (n + 1) / 2, kAll = n * n;
  double value_value[kEven][kAxisPoints] = {}, slope_slope[kEven][kAxisPoints] = {};
  double slope_value[kAll][kAxisPoints] = {};  // n (of the slope) + of the value

  constexpr Products() {
    constexpr double at[kAxisPoints] = {
        -0.90617984593866399279762687829939, -0.53846931010568309103631442070021, 0,
        0.53846931010568309103631442070021, 0.90617984593866399279762687829939};
    for (std::size_t q = 0; q < kAxisPoints; ++q) {
      const double t = at[q];
      const double quadratic[3] = {t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2},
                   slopes[3] = {t - 0.5, -2 * t, t + 0.5};
      const double linear[2] = {(1 - t) / 2, (1 + t) / 2}, even[2] = {-0.5, 0.5};
      const double *value = n == 3 ? quadratic : linear, *slope = n == 3 ? slopes : even;
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = 0; b < n; ++b) {
          value_value[unordered(a, b)][q] = value[a] * value[b];
          slope_slope[unordered(a, b)][q] = slope[a] * slope[b];
          slope_value[n * a + b][q] = slope[a] * value[b];
        }
    }
  }
};
template <std::size_t n>
constexpr Products<n> kProducts;

FLEXEL_INLINE V weighted(const V* at, const double* weight) {
  V sum = at[0] * weight[0];
#pragma GCC unroll 4
  for (std::size_t q = 1; q < kAxisPoints; ++q) sum += at[q] * weight[q];
  return sum;
}

template <std::size_t pairs>
using AtPlane = V[pairs][kPlanePoints];
template <std::size_t x_pairs, std::size_t y_pairs>
using AtLine = V[x_pairs][y_pairs][kAxisPoints];

// Sums along y. `from`: z slow, y fast.
template <std::size_t x_pairs, std::size_t y_pairs>
FLEXEL_INLINE void along_y(const AtPlane<x_pairs>& from, const double (&weight)[y_pairs][kAxisPoints],
                           AtLine<x_pairs, y_pairs>& to) {
  for (std::size_t x = 0; x < x_pairs; ++x)
#pragma GCC unroll 1
    for (std::size_t z = 0; z < kAxisPoints; ++z)
#pragma GCC unroll 1
      for (std::size_t y = 0; y < y_pairs; ++y) to[x][y][z] = weighted(&from[x][kAxisPoints * z], weight[y]);
}

// int d_j N_a d_l N_b summed along x and y, by the pairs of shape functions along these; xx: j and l are x.
template <std::size_t n>
struct Lines {
  static constexpr std::size_t kEven = Products<n>::kEven, kAll = Products<n>::kAll;
  AtLine<kEven, kEven> xx, yy, zz;
  AtLine<kAll, kAll> xy;   // slope by x of a, slope by y of b: pairs n a + b along x, n b + a along y
  AtLine<kAll, kEven> xz;  // slope by x of a
  AtLine<kEven, kAll> yz;  // slope by y of a
};

template <std::size_t n>
FLEXEL_INLINE void sum_lines(const double* moments, Lines<n>& lines) {
  constexpr std::size_t kEven = Products<n>::kEven, kAll = Products<n>::kAll;
  AtPlane<kEven> value_value, slope_slope;
  AtPlane<kAll> slope_value;
#pragma GCC unroll 1
  for (std::size_t line = 0; line < kPlanePoints; ++line) {
    V at[kAxisPoints];
    for (std::size_t q = 0; q < kAxisPoints; ++q) at[q] = get<V>(moments, kAxisPoints * line + q);
    for (std::size_t pair = 0; pair < kEven; ++pair) {
      value_value[pair][line] = weighted(at, kProducts<n>.value_value[pair]);
      slope_slope[pair][line] = weighted(at, kProducts<n>.slope_slope[pair]);
    }
    for (std::size_t pair = 0; pair < kAll; ++pair)
      slope_value[pair][line] = weighted(at, kProducts<n>.slope_value[pair]);
  }
  along_y<kEven, kEven>(slope_slope, kProducts<n>.value_value, lines.xx);
  along_y<kEven, kEven>(value_value, kProducts<n>.slope_slope, lines.yy);
  along_y<kEven, kEven>(value_value, kProducts<n>.value_value, lines.zz);
  along_y<kAll, kAll>(slope_value, kProducts<n>.slope_value, lines.xy);
  along_y<kAll, kEven>(slope_value, kProducts<n>.value_value, lines.xz);
  along_y<kEven, kAll>(value_value, kProducts<n>.slope_value, lines.yz);
}

// Weights of the points of a pair of shape functions along z, with the scales of both slopes.
struct LineWeights {
  double xx[kAxisPoints], yy[kAxisPoints], zz[kAxisPoints], xy[kAxisPoints], xz[kAxisPoints], zx[kAxisPoints],
      yz[kAxisPoints], zy[kAxisPoints];

  template <std::size_t n>
  FLEXEL_INLINE void set(const double (&scale)[3], std::size_t az, std::size_t bz) {
    const std::size_t pair = unordered(az, bz);
    for (std::size_t q = 0; q < kAxisPoints; ++q) {
      const double even = kProducts<n>.value_value[pair][q];
      xx[q] = scale[0] * scale[0] * even;
      yy[q] = scale[1] * scale[1] * even;
      xy[q] = scale[0] * scale[1] * even;
      zz[q] = scale[2] * scale[2] * kProducts<n>.slope_slope[pair][q];
      const double b = scale[2] * kProducts<n>.slope_value[n * bz + az][q],
                   a = scale[2] * kProducts<n>.slope_value[n * az + bz][q];
      xz[q] = scale[0] * b;
      zx[q] = scale[0] * a;
      yz[q] = scale[1] * b;
      zy[q] = scale[1] * a;
    }
  }
};

// integrals: int d_j N_a d_l N_b -> the block of nodes a and b.
template <bool isotropic>
FLEXEL_INLINE void put_block(const Elasticity<double>& part, const V (&integrals)[3][3], double* to) {
  if constexpr (isotropic) {
    const double lambda = part.moduli[1], mu = part.moduli[21];
    const V trace = mu * (integrals[0][0] + integrals[1][1] + integrals[2][2]);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        V sum = lambda * integrals[i][k] + mu * integrals[k][i];
        if (i == k) sum += trace;
        put(to, 3 * i + k, sum);
      }
  } else {
    constexpr std::size_t of[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        V sum{};
        for (std::size_t j = 0; j < 3; ++j)
          for (std::size_t l = 0; l < 3; ++l) sum += part.moduli[6 * of[i][j] + of[k][l]] * integrals[j][l];
        put(to, 3 * i + k, sum);
      }
  }
}

// All blocks of nodes that lie at az and bz along z.
template <std::size_t n, bool isotropic>
FLEXEL_INLINE void put_blocks(const Lines<n>& lines, const Elasticity<double>& part, std::size_t az,
                              std::size_t bz, double* to) {
  LineWeights weight;
  weight.set<n>(part.scale, az, bz);
#pragma GCC unroll 1
  for (std::size_t at_a = 0; at_a < n * n; ++at_a)
#pragma GCC unroll 1
    for (std::size_t at_b = 0; at_b < n * n; ++at_b) {
      const std::size_t a = at_a + n * n * az, b = at_b + n * n * bz;
      if (a < b) continue;
      const std::size_t ax = at_a % n, ay = at_a / n, bx = at_b % n, by = at_b / n;
      const std::size_t x = unordered(ax, bx), y = unordered(ay, by);
      const std::size_t ab_x = n * ax + bx, ba_x = n * bx + ax, ab_y = n * ay + by, ba_y = n * by + ay;
      const V integrals[3][3] = {
          {weighted(lines.xx[x][y], weight.xx), weighted(lines.xy[ab_x][ba_y], weight.xy),
           weighted(lines.xz[ab_x][y], weight.xz)},
          {weighted(lines.xy[ba_x][ab_y], weight.xy), weighted(lines.yy[x][y], weight.yy),
           weighted(lines.yz[x][ab_y], weight.yz)},
          {weighted(lines.xz[ba_x][y], weight.zx), weighted(lines.yz[x][ba_y], weight.zy),
           weighted(lines.zz[x][y], weight.zz)}};
      put_block<isotropic>(part, integrals, to + kWidth * block_place(a, b));
    }
}

// Of `n` nodes along each axis.
template <std::size_t n>
void some_matrices(const double* moments, const Elasticity<double>& part, double* to) {
  Lines<n> lines;
  sum_lines<n>(moments, lines);
#pragma GCC unroll 1
  for (std::size_t az = 0; az < n; ++az)
#pragma GCC unroll 1
    for (std::size_t bz = 0; bz <= az; ++bz)
      if (part.isotropic)
        put_blocks<n, true>(lines, part, az, bz, to);
      else
        put_blocks<n, false>(lines, part, az, bz, to);
}

void matrices(const double* moments, const Elasticity<double>& part, double* of_nodes, double* of_corners) {
  for (std::size_t lane = 0; lane < kWidth; lane += kLanes<double>) {
    some_matrices<3>(moments + lane, part, of_nodes + lane);
    some_matrices<2>(moments + lane, part, of_corners + lane);
  }
}

constexpr std::size_t kPaddedRows = kRows * kGroups;

// The blocks of four by four that a row of blocks has in a column of blocks.
struct Block4 {
  V at[kRows][kRows];
};

FLEXEL_INLINE double* entry(double* matrix, std::size_t row, std::size_t column) {
  return matrix + kWidth * (row_place(row) + column);
}
FLEXEL_INLINE Block4 block(double* matrix, std::size_t row, std::size_t column) {
  Block4 found;
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t c = 0; c < kRows; ++c) found.at[r][c] = get<V>(entry(matrix, row + r, column), c);
  return found;
}
FLEXEL_INLINE void put_block4(double* matrix, std::size_t row, std::size_t column, const Block4& from) {
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t c = 0; c < kRows; ++c) put(entry(matrix, row + r, column), c, from.at[r][c]);
}

// Lanes whose pivot is not positive, which become 1.
FLEXEL_INLINE unsigned check_pivots(V& pivot) {
  unsigned failed = 0;
  for (std::size_t l = 0; l < kLanes<double>; ++l)
    if (!(pivot[l] > 0)) {
      failed |= 1u << l;
      pivot[l] = 1;
    }
  return failed;
}

FLEXEL_INLINE V inverse_roots(const V& x) {
  V root;
  for (std::size_t l = 0; l < kLanes<double>; ++l) root[l] = __builtin_sqrt(x[l]);
  return 1 / root;
}

// L of L L^T, in place of the lower triangle; `inverse`: 1 / its diagonal. Returns the lanes that are not positive.
unsigned factorise(double* matrix, V (&inverse)[kPaddedRows]) {
  unsigned failed = 0;
#pragma GCC unroll 1
  for (std::size_t row = 0; row < kPaddedRows; row += kRows)
#pragma GCC unroll 1
    for (std::size_t column = 0; column <= row; column += kRows) {
      Block4 own = block(matrix, row, column);
      const double *left[kRows], *up[kRows];
      for (std::size_t r = 0; r < kRows; ++r) {
        left[r] = entry(matrix, row + r, 0);
        up[r] = entry(matrix, column + r, 0);
      }
#pragma GCC unroll 1
      for (std::size_t k = 0; k < column; ++k)
        for (std::size_t r = 0; r < kRows; ++r)
          for (std::size_t c = 0; c < kRows; ++c) own.at[r][c] -= get<V>(left[r], k) * get<V>(up[c], k);
      const Block4 above = row == column ? own : block(matrix, column, column);
      for (std::size_t c = 0; c < kRows; ++c) {
        if (row == column) {
          V pivot = own.at[c][c];
          for (std::size_t d = 0; d < c; ++d) pivot -= own.at[c][d] * own.at[c][d];
          failed |= check_pivots(pivot);
          inverse[row + c] = inverse_roots(pivot);
          own.at[c][c] = pivot * inverse[row + c];
        }
        for (std::size_t r = row == column ? c + 1 : 0; r < kRows; ++r) {
          for (std::size_t d = 0; d < c; ++d)
            own.at[r][c] -= own.at[r][d] * (row == column ? own.at[c][d] : above.at[c][d]);
          own.at[r][c] *= inverse[column + c];
        }
      }
      put_block4(matrix, row, column, own);
    }
  return failed;
}

// The inverse of a lower triangle of four rows.
FLEXEL_INLINE Block4 inverse_of(const Block4& lower, const V* inverse) {
  Block4 found;
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t c = 0; c < kRows; ++c) {
      V sum{};
      for (std::size_t d = c; d < r; ++d) sum += lower.at[r][d] * found.at[d][c];
      found.at[r][c] = r == c ? inverse[r] : r < c ? V{} : -sum * inverse[r];
    }
  return found;
}

// L^-1 in place of L.
void invert(double* matrix, const V (&inverse)[kPaddedRows]) {
#pragma GCC unroll 1
  for (std::size_t row = 0; row < kPaddedRows; row += kRows) {
    const Block4 last = inverse_of(block(matrix, row, row), inverse + row);
    const double* left[kRows];
    for (std::size_t r = 0; r < kRows; ++r) left[r] = entry(matrix, row + r, 0);
#pragma GCC unroll 1
    for (std::size_t column = 0; column < row; column += kRows) {
      Block4 sum{}, found;
#pragma GCC unroll 1
      for (std::size_t k = column; k < row; ++k) {
        const double* up = entry(matrix, k, column);
        for (std::size_t r = 0; r < kRows; ++r)
          for (std::size_t c = 0; c < kRows; ++c) sum.at[r][c] += get<V>(left[r], k) * get<V>(up, c);
      }
      for (std::size_t r = 0; r < kRows; ++r)
        for (std::size_t c = 0; c < kRows; ++c) {
          found.at[r][c] = -last.at[r][0] * sum.at[0][c];
          for (std::size_t d = 1; d <= r; ++d) found.at[r][c] -= last.at[r][d] * sum.at[d][c];
        }
      put_block4(matrix, row, column, found);
    }
    put_block4(matrix, row, row, last);
  }
}

// D A D + raised, and ones in the rows that pad it; returns D.
void scale_rows(double* matrix, double raised, V (&scale)[kPaddedRows]) {
  constexpr double kLeast = 1e-300;
  for (std::size_t r = 0; r < kUnknowns; ++r) {
    V diagonal = get<V>(entry(matrix, r, 0), r);
    for (std::size_t l = 0; l < kLanes<double>; ++l) {
      const double size = diagonal[l] < 0 ? -diagonal[l] : diagonal[l];
      diagonal[l] = size > kLeast ? size : kLeast;
    }
    scale[r] = inverse_roots(diagonal);
    double* row = entry(matrix, r, 0);
    for (std::size_t c = 0; c <= r; ++c) put(row, c, get<V>(row, c) * (scale[r] * scale[c]));
    put(row, r, get<V>(row, r) + raised);
  }
  for (std::size_t r = kUnknowns; r < kPaddedRows; ++r)
    for (std::size_t c = 0; c < kPaddedRows; ++c) put(entry(matrix, r, 0), c, V{} + (r == c ? 1 : 0));
}

// Into steps of 16 bits, of the first lanes that did not fail.
void round_rows(double* matrix, const V (&scale)[kPaddedRows], std::size_t count, unsigned failed,
                Triangle* to) {
  using Short = std::int16_t[kPaddedUnknowns];
  std::size_t place = 0;
  for (std::size_t r = 0; r < kUnknowns; ++r) {
    const double* row = entry(matrix, r, 0);
    for (std::size_t l = 0; l < count; ++l) {
      if ((failed >> l & 1) != 0) continue;
      double most = 0;
      for (std::size_t c = 0; c <= r; ++c) {
        const double number = row[kWidth * c + l], size = number < 0 ? -number : number;
        most = size > most ? size : most;
      }
      Short steps;
      const double by = kMostSteps / most;
      for (std::size_t c = 0; c <= r; ++c) {
        const double number = row[kWidth * c + l] * by;
        steps[c] = static_cast<std::int16_t>(static_cast<int>(number + (number < 0 ? -0.5 : 0.5)));
      }
      to[l].step[r] = static_cast<float>(most / kMostSteps);
      to[l].scale[r] = static_cast<float>(scale[r][l]);
      __builtin_memcpy(to[l].steps + place, steps, (r + 1) * sizeof(std::int16_t));
    }
    place += group_columns(r / kRows);
  }
}

unsigned invert_factors(double* matrix, double raised, std::size_t count, Triangle* to) {
  unsigned all_failed = 0;
  for (std::size_t lane = 0; lane < count; lane += kLanes<double>) {
    V scale[kPaddedRows], inverse[kPaddedRows];
    scale_rows(matrix + lane, raised, scale);
    const unsigned failed = factorise(matrix + lane, inverse);
    invert(matrix + lane, inverse);
    const std::size_t left = count - lane;
    round_rows(matrix + lane, scale, left < kLanes<double> ? left : kLanes<double>, failed, to + lane);
    all_failed |= failed << lane;
  }
  return all_failed;
}

}  // namespace

#define FLEXEL_JOIN(a, b) a##b
#define FLEXEL_TABLE(isa) FLEXEL_JOIN(matrices_, isa)
const MatrixTable& FLEXEL_TABLE(FLEXEL_ISA)() {
  static const MatrixTable table{&matrices, &invert_factors};
  return table;
}

}  // namespace flexel::simulate::quadratic_kernel
