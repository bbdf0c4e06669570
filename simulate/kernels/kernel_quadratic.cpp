// K u of eight cells: the field's gradient at Gauss's points, the stress there, and the same way back. Along each axis the
// field is m + h t + c t^2 with t from -1 to 1, and a sum over the points goes axis by axis (sum factorization; Orszag,
// J. Comput. Phys. 37, 1980). A cell's own matrix would be 26 kB to read, its moments are 1 kB.
#include "simulate/kernels/kernel_quadratic.h"

#include "simulate/kernels/quadratic_vectors.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::simulate::quadratic_kernel {
namespace {

static_assert(kSideBySide == kWidth);

// Gauss's points on [-1, 1].
template <std::size_t kPoints>
constexpr double kAt[kPoints] = {};
template <>
constexpr double kAt<3>[3] = {-0.77459666924148337703585307995648, 0, 0.77459666924148337703585307995648};
template <>
constexpr double kAt<5>[5] = {-0.90617984593866399279762687829939, -0.53846931010568309103631442070021, 0,
                              0.53846931010568309103631442070021, 0.90617984593866399279762687829939};

// Of a field along an axis, or of the forces that work on one: m, h, c.
template <class V, class Number>
FLEXEL_INLINE V value(const V* line, Number t) {
  return line[0] + t * (line[1] + t * line[2]);
}
template <class V, class Number>
FLEXEL_INLINE V slope(const V* line, Number t) {
  return line[1] + (2 * t) * line[2];
}
template <class V, class Number>
FLEXEL_INLINE void add_value(V* line, Number t, const V& force) {
  const V moment = t * force;
  line[0] += force;
  line[1] += moment;
  line[2] += t * moment;
}
template <class V, class Number>
FLEXEL_INLINE void add_slope(V* line, Number t, const V& force) {
  line[1] += force;
  line[2] += (2 * t) * force;
}

// Nodes along `stride` -> m, h, c in their places, and back for forces.
template <class V>
FLEXEL_INLINE void to_line(V* at, std::size_t stride) {
  const V first = at[0], middle = at[stride], last = at[2 * stride];
  at[0] = middle;
  at[stride] = (last - first) * 0.5F;
  at[2 * stride] = (last + first) * 0.5F - middle;
}
template <class V>
FLEXEL_INLINE void to_nodes(V* at, std::size_t stride) {
  const V m = at[0], half_h = at[stride] * 0.5F, c = at[2 * stride];
  at[0] = c * 0.5F - half_h;
  at[stride] = m - c;
  at[2 * stride] = c * 0.5F + half_h;
}
template <class V, class Change>
FLEXEL_INLINE void along_all_axes(V (&field)[3][27], const Change& change) {
  for (auto& component : field) {
    for (std::size_t line = 0; line < 9; ++line) change(component + 3 * line, 1);
    for (std::size_t line = 0; line < 9; ++line) change(component + 9 * (line / 3) + line % 3, 3);
    for (std::size_t line = 0; line < 9; ++line) change(component + line, 9);
  }
}

// strain (xx, yy, zz, xy, yz, zx) -> stress
template <bool isotropic, class V, class Number>
FLEXEL_INLINE void to_stress(const Elasticity<Number>& part, const V (&strain)[6], V (&stress)[6]) {
  if constexpr (isotropic) {
    const Number mu = part.moduli[21];
    const V pressure = part.moduli[1] * (strain[0] + strain[1] + strain[2]);
    for (int i = 0; i < 3; ++i) stress[i] = pressure + (2 * mu) * strain[i];
    for (int i = 3; i < 6; ++i) stress[i] = mu * strain[i];
  } else {
    for (int i = 0; i < 6; ++i) {
      V sum = part.moduli[6 * i] * strain[0];
      for (int j = 1; j < 6; ++j) sum += part.moduli[6 * i + j] * strain[j];
      stress[i] = sum;
    }
  }
}

// One point of a line along z: `u` and `f` are m, h, c of the derivatives of each component by x, y, z.
template <bool isotropic, class V, class Number>
FLEXEL_INLINE void add_point(const Elasticity<Number>& part, const V (&u)[3][3][3], Number t, const V& weight,
                             V (&f)[3][3][3]) {
  V by[3][3], stress[6];
  for (int i = 0; i < 3; ++i) {
    by[i][0] = value(u[i][0], t);
    by[i][1] = value(u[i][1], t);
    by[i][2] = slope(u[i][2], t);
  }
  const V strain[6] = {by[0][0],           by[1][1], by[2][2], by[0][1] + by[1][0], by[1][2] + by[2][1],
                       by[2][0] + by[0][2]};
  to_stress<isotropic>(part, strain, stress);
  for (V& each : stress) each *= weight;
  constexpr int of[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
  for (int i = 0; i < 3; ++i) {
    add_value(f[i][0], t, stress[of[i][0]]);
    add_value(f[i][1], t, stress[of[i][1]]);
    add_slope(f[i][2], t, stress[of[i][2]]);
  }
}

// The points of one x. `at`, `by`: lines along y of the field and of its derivative by x, three side by side along z; their
// forces are added to `force_at`, `force_by`. `moments`: of the first of the points.
template <std::size_t kPoints, bool isotropic, class V, class Number>
FLEXEL_INLINE void add_plane(const Elasticity<Number>& part, const Number* moments, const V (&at)[3][9],
                             const V (&by)[3][9], V (&force_at)[3][9], V (&force_by)[3][9]) {
  const Number along_y = part.scale[1], along_z = part.scale[2];
#pragma GCC unroll 1
  for (std::size_t iy = 0; iy < kPoints; ++iy) {
    const auto y = static_cast<Number>(kAt<kPoints>[iy]);
    V u[3][3][3], f[3][3][3] = {};
    for (int i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        u[i][0][k] = value(by[i] + 3 * k, y);
        u[i][1][k] = along_y * slope(at[i] + 3 * k, y);
        u[i][2][k] = along_z * value(at[i] + 3 * k, y);
      }
#pragma GCC unroll 1
    for (std::size_t iz = 0; iz < kPoints; ++iz)
      add_point<isotropic>(part, u, static_cast<Number>(kAt<kPoints>[iz]),
                           get<V>(moments, kPoints * (iy + kPoints * iz)), f);
    for (int i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        add_value(force_by[i] + 3 * k, y, f[i][0][k]);
        add_slope(force_at[i] + 3 * k, y, along_y * f[i][1][k]);
        add_value(force_at[i] + 3 * k, y, along_z * f[i][2][k]);
      }
  }
}

// `field`: m, h, c along each axis -> the forces that work on them.
template <std::size_t kPoints, bool isotropic, class V, class Number>
FLEXEL_INLINE void through_points(const EightCells<Number>& cells, const Elasticity<Number>& part,
                                  V (&field)[3][27]) {
  V force[3][27] = {};
  const Number along_x = part.scale[0];
#pragma GCC unroll 1  // unrolled, the code is larger than the cache for it
  for (std::size_t ix = 0; ix < kPoints; ++ix) {
    const auto x = static_cast<Number>(kAt<kPoints>[ix]);
    V at[3][9], by[3][9], force_at[3][9] = {}, force_by[3][9] = {};
    for (int i = 0; i < 3; ++i)
      for (std::size_t line = 0; line < 9; ++line) {
        at[i][line] = value(field[i] + 3 * line, x);
        by[i][line] = along_x * slope(field[i] + 3 * line, x);
      }
    add_plane<kPoints, isotropic>(part, cells.moments + kWidth * ix, at, by, force_at, force_by);
    for (int i = 0; i < 3; ++i)
      for (std::size_t line = 0; line < 9; ++line) {
        add_value(force[i] + 3 * line, x, force_at[i][line]);
        add_slope(force[i] + 3 * line, x, along_x * force_by[i][line]);
      }
  }
  __builtin_memcpy(&field, &force, sizeof field);
}

// `rotation` (9 x 8) times the three values of each node; its transpose.
template <class V, class Number>
FLEXEL_INLINE void rotate(const Number* rotation, bool back, V (&field)[3][27]) {
  V r[9];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) r[3 * i + j] = get<V>(rotation, back ? 3 * j + i : 3 * i + j);
  for (std::size_t n = 0; n < 27; ++n) {
    const V x = field[0][n], y = field[1][n], z = field[2][n];
    for (std::size_t i = 0; i < 3; ++i) field[i][n] = r[3 * i] * x + r[3 * i + 1] * y + r[3 * i + 2] * z;
  }
}

// force += a (gamma^T u) + gamma (a^T u)
template <class V, class Number>
FLEXEL_INLINE void add_turning(const EightCells<Number>& cells, const V (&u)[3][27], V (&force)[3][27]) {
  V along_a[3] = {}, along_gamma[3] = {};
  for (std::size_t n = 0; n < 27; ++n)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t place = 3 * (3 * n + i) + k;
        along_a[k] += get<V>(cells.a, place) * u[i][n];
        along_gamma[k] += get<V>(cells.gamma, place) * u[i][n];
      }
  for (std::size_t n = 0; n < 27; ++n)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t place = 3 * (3 * n + i) + k;
        force[i][n] += get<V>(cells.a, place) * along_gamma[k] + get<V>(cells.gamma, place) * along_a[k];
      }
}

template <std::size_t kPoints, class Number>
FLEXEL_INLINE void some_products(const EightCells<Number>& cells, const Elasticity<Number>& part,
                                 Number* values) {
  using V = typename VectorOf<Number>::Type;
  V field[3][27], moved[3][27];
  for (std::size_t n = 0; n < 27; ++n)
    for (std::size_t i = 0; i < 3; ++i) field[i][n] = get<V>(values, 3 * n + i);
  if (cells.rotation != nullptr) rotate(cells.rotation, false, field);
  if (cells.a != nullptr) __builtin_memcpy(&moved, &field, sizeof moved);
  along_all_axes(field, [](V* at, std::size_t stride) { to_line(at, stride); });
  if (part.isotropic)
    through_points<kPoints, true>(cells, part, field);
  else
    through_points<kPoints, false>(cells, part, field);
  along_all_axes(field, [](V* at, std::size_t stride) { to_nodes(at, stride); });
  if (cells.a != nullptr) add_turning(cells, moved, field);
  if (cells.rotation != nullptr) rotate(cells.rotation, true, field);
  for (std::size_t n = 0; n < 27; ++n)
    for (std::size_t i = 0; i < 3; ++i) put(values, 3 * n + i, field[i][n]);
}

template <std::size_t kPoints, class Number>
void product(const EightCells<Number>& cells, const Elasticity<Number>& part, Number* values) {
#pragma GCC unroll 1
  for (std::size_t lane = 0; lane < kWidth; lane += kLanes<Number>) {
    const auto from = [&](const Number* first) { return first == nullptr ? nullptr : first + lane; };
    some_products<kPoints>(
        EightCells<Number>{cells.moments + lane, from(cells.rotation), from(cells.a), from(cells.gamma)},
        part, values + lane);
  }
}

using FourFloats = float __attribute__((vector_size(16)));

// Of eight numbers each, in the same order for any length of the vectors.
template <class V, std::size_t kParts>
FLEXEL_INLINE FourFloats sums_of(const V (&rows)[kRows][kParts]) {
  FourFloats half[kRows];
  for (std::size_t r = 0; r < kRows; ++r)
    if constexpr (kParts == 1)
      half[r] = __builtin_shufflevector(rows[r][0], rows[r][0], 0, 1, 2, 3) +
                __builtin_shufflevector(rows[r][0], rows[r][0], 4, 5, 6, 7);
    else
      half[r] = rows[r][0] + rows[r][1];
  const FourFloats low01 = __builtin_shufflevector(half[0], half[1], 0, 4, 1, 5),
                   high01 = __builtin_shufflevector(half[0], half[1], 2, 6, 3, 7),
                   low23 = __builtin_shufflevector(half[2], half[3], 0, 4, 1, 5),
                   high23 = __builtin_shufflevector(half[2], half[3], 2, 6, 3, 7);
  return (__builtin_shufflevector(low01, low23, 0, 1, 4, 5) +
          __builtin_shufflevector(low01, low23, 2, 3, 6, 7)) +
         (__builtin_shufflevector(high01, high23, 0, 1, 4, 5) +
          __builtin_shufflevector(high01, high23, 2, 3, 6, 7));
}

// Four rows at a time: their products with x, then y += the rows times those; the matrix is read from memory once.
void square(const Triangle& triangle, float* x, float* y) {
  using V = VectorOf<float>::Type;
  using Short = std::int16_t __attribute__((vector_size(sizeof(std::int16_t) * kLanes<float>)));
  constexpr std::size_t kStep = kLanes<float>;
  using Int = std::int32_t __attribute__((vector_size(sizeof(V))));
  const auto numbers = [](const std::int16_t* from) {
    return __builtin_convertvector(__builtin_convertvector(simd::load_as<Short>(from), Int), V);
  };
  for (std::size_t i = 0; i < kPaddedUnknowns; ++i) {
    x[i] *= triangle.scale[i];
    y[i] = 0;
  }
  const std::int16_t* steps = triangle.steps;
  for (std::size_t group = 0; group < kGroups; ++group) {
    const std::size_t columns = group_columns(group);
    V sum[kRows][kWidth / kStep] = {}, rows[kPaddedUnknowns / kStep][kRows];
#pragma GCC unroll 1
    for (std::size_t j = 0; j < columns; j += kWidth)
      for (std::size_t part = 0; part < kWidth / kStep; ++part) {
        const std::size_t first = j + kStep * part;
        const V at = simd::load_as<V>(x + first);
        for (std::size_t r = 0; r < kRows; ++r) {
          const V number = numbers(steps + r * columns + first);
          rows[first / kStep][r] = number;
          sum[r][part] += number * at;
        }
      }
    const FourFloats step = simd::load_as<FourFloats>(triangle.step + kRows * group);
    const FourFloats whole = step * step * sums_of(sum);
#pragma GCC unroll 1
    for (std::size_t j = 0; j < columns; j += kStep) {
      V to = simd::load_as<V>(y + j);
      for (std::size_t r = 0; r < kRows; ++r) to += whole[r] * rows[j / kStep][r];
      __builtin_memcpy(y + j, &to, sizeof to);
    }
    steps += kRows * columns;
  }
  for (std::size_t i = 0; i < kPaddedUnknowns; ++i) y[i] *= triangle.scale[i];
}

}  // namespace

const Table& FLEXEL_ISA() {
  static const Table table{
      {&product<3, double>, &product<5, double>}, {&product<3, float>, &product<5, float>}, &square};
  return table;
}

}  // namespace flexel::simulate::quadratic_kernel
