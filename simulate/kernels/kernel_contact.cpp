// Sums run in the order in which Eigen's do, so that a pair or point that is looked at by itself has the same bits.
#include "simulate/kernels/kernel_contact.h"

#ifdef __AVX__
#include <immintrin.h>
#endif

#include "base/simd.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::simulate::contact_kernels {
namespace {

using simd::FourDoubles;
using simd::LaneBits;
using simd::LaneMask;
using simd::Lanes;
using simd::load;
using simd::shuffle;
using simd::square_root;
using simd::store;

static_assert(kLanes == simd::kLanes && sizeof(CarriedPoint) == 4 * 64);

// As in ContactSurface::shape_at().
constexpr double kLeastVolume = 0.05, kMostStretch = 25;
constexpr double kPoint = 1.2, kBounds = 1.5, kMostTurn = 0.3;

struct Three {
  Lanes x, y, z;
};
FLEXEL_INLINE Three operator+(const Three& a, const Three& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
FLEXEL_INLINE Three operator-(const Three& a, const Three& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
FLEXEL_INLINE Three operator*(const Lanes& a, const Three& b) {
  return {a * b.x, a * b.y, a * b.z};
}
FLEXEL_INLINE Three operator/(const Three& a, const Lanes& b) {
  return {a.x / b, a.y / b, a.z / b};
}
FLEXEL_INLINE Lanes dot(const Three& a, const Three& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
FLEXEL_INLINE Lanes pick(const LaneMask& where, const Lanes& yes, const Lanes& no) {
  return where ? yes : no;
}
FLEXEL_INLINE Three pick(const LaneMask& where, const Three& yes, const Three& no) {
  return {pick(where, yes.x, no.x), pick(where, yes.y, no.y), pick(where, yes.z, no.z)};
}
// Of row i of a product of a 3 x 3 matrix: Eigen adds two rows together, and the third from its end.
FLEXEL_INLINE Lanes row_sum(int i, const Lanes& x, const Lanes& y, const Lanes& z) {
  return i == 2 ? x + (y + z) : x + y + z;
}
FLEXEL_INLINE LaneMask is_zero(const Three& a) {
  return (a.x == 0) & (a.y == 0) & (a.z == 0);
}
FLEXEL_INLINE Lanes larger(const Lanes& a, const Lanes& b) {
  return a < b ? b : a;
}  // std::max
FLEXEL_INLINE Lanes smaller(const Lanes& a, const Lanes& b) {
  return b < a ? b : a;
}  // std::min
FLEXEL_INLINE Lanes absolute(const Lanes& a) {
  return a < 0 ? -a : a;
}

FLEXEL_INLINE Lanes bits_of(const LaneMask& flags) {
  Lanes made;
  __builtin_memcpy(&made, &flags, sizeof made);
  return made;
}

FLEXEL_INLINE bool any(const LaneMask& mask) {
  long long bits = 0;
  for (std::size_t l = 0; l < kLanes; ++l) bits |= mask[l];
  return bits != 0;
}

// Rows to columns and back.
FLEXEL_INLINE void transpose(Lanes r[8]) {
  constexpr LaneBits even = {0, 8, 2, 10, 4, 12, 6, 14}, odd = {1, 9, 3, 11, 5, 13, 7, 15};
  constexpr LaneBits low = {0, 1, 8, 9, 4, 5, 12, 13}, high = {2, 3, 10, 11, 6, 7, 14, 15};
  constexpr LaneBits first = {0, 1, 2, 3, 8, 9, 10, 11}, second = {4, 5, 6, 7, 12, 13, 14, 15};
  Lanes a[8], b[8];
#pragma GCC unroll 4
  for (int n = 0; n < 8; n += 2) {
    a[n] = shuffle(r[n], r[n + 1], even);
    a[n + 1] = shuffle(r[n], r[n + 1], odd);
  }
#pragma GCC unroll 2
  for (int n = 0; n < 8; n += 4) {
    b[n] = shuffle(a[n], a[n + 2], low);
    b[n + 1] = shuffle(a[n + 1], a[n + 3], low);
    b[n + 2] = shuffle(a[n], a[n + 2], high);
    b[n + 3] = shuffle(a[n + 1], a[n + 3], high);
  }
#pragma GCC unroll 4
  for (int n = 0; n < 4; ++n) {
    r[n] = shuffle(b[n], b[n + 4], first);
    r[n + 4] = shuffle(b[n], b[n + 4], second);
  }
}

// Of a block of eight; where there are fewer, the last one again.
struct Block {
  std::size_t count;
  std::uint32_t at[kLanes];
};
FLEXEL_INLINE Block block_of(const std::uint32_t* which, std::size_t begin, std::size_t count) {
  Block block;
  block.count = count - begin < kLanes ? count - begin : kLanes;
  for (std::size_t l = 0; l < kLanes; ++l)
    block.at[l] = which[begin + (l < block.count ? l : block.count - 1)];
  return block;
}

FLEXEL_INLINE FourDoubles load_three(const double* from) {
#ifdef __AVX__
  return _mm256_maskload_pd(from, __m256i{-1, -1, -1, 0});
#else
  return FourDoubles{from[0], from[1], from[2], 0};
#endif
}

FLEXEL_INLINE void store_three(double* to, const FourDoubles& value) {
  using TwoDoubles = double __attribute__((vector_size(16)));
  const TwoDoubles two = {value[0], value[1]};
  __builtin_memcpy(to, &two, sizeof two);
  to[2] = value[2];
}

// What store_three() has written a moment ago: in its two pieces it need not wait for the cache.
FLEXEL_INLINE FourDoubles load_stored_three(const double* from) {
  using TwoDoubles = double __attribute__((vector_size(16)));
  TwoDoubles two;
  __builtin_memcpy(&two, from, sizeof two);
  return FourDoubles{two[0], two[1], from[2], 0};
}

FLEXEL_INLINE void store_four(double* to, const FourDoubles& value) {
  __builtin_memcpy(to, &value, sizeof value);
}

struct Interpolated {
  Three value;     // at the points
  Three along[3];  // CarryingCells::differences()
};

FLEXEL_INLINE void interpolate(const CarriedPoint* points, const Block& block, const double* values,
                               Interpolated& made) {
  alignas(64) double rows[kLanes][16];
  for (std::size_t l = 0; l < kLanes; ++l) {
    const CarriedPoint& point = points[block.at[l]];
    FourDoubles v[8];
    for (int a = 0; a < 8; ++a) v[a] = load_three(values + 3 * std::size_t{point.elements[a]});
    FourDoubles sum = {};
    for (int a = 0; a < 8; ++a) sum += point.weights[a] * v[a];
    const FourDoubles up01 = v[1] - v[0], up23 = v[3] - v[2], up45 = v[5] - v[4], up67 = v[7] - v[6];
    const FourDoubles sum01 = v[0] + v[1], sum23 = v[2] + v[3], sum45 = v[4] + v[5], sum67 = v[6] + v[7];
    store_four(rows[l], sum);
    store_four(rows[l] + 4, (up01 + up23) + (up45 + up67));
    store_four(rows[l] + 8, (sum23 - sum01) + (sum67 - sum45));
    store_four(rows[l] + 12, (sum45 + sum67) - (sum01 + sum23));
  }
  Lanes c[8];
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(rows[l]);
  transpose(c);
  made.value = {c[0], c[1], c[2]};
  made.along[0] = {c[4], c[5], c[6]};
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(rows[l] + 8);
  transpose(c);
  made.along[1] = {c[0], c[1], c[2]};
  made.along[2] = {c[4], c[5], c[6]};
}

struct Nine {
  Lanes at[3][3];  // row, column
};

// sum over the axes of along (x) slope
FLEXEL_INLINE Nine gradient(const Interpolated& values, const Three slopes[3]) {
  Nine made;
  const Three* d = values.along;
  for (int j = 0; j < 3; ++j) {
    Lanes s[3];
    for (int k = 0; k < 3; ++k) s[k] = j == 0 ? slopes[k].x : j == 1 ? slopes[k].y : slopes[k].z;
    made.at[0][j] = d[0].x * s[0] + d[1].x * s[1] + d[2].x * s[2];
    made.at[1][j] = d[0].y * s[0] + d[1].y * s[1] + d[2].y * s[2];
    made.at[2][j] = d[0].z * s[0] + d[1].z * s[1] + d[2].z * s[2];
  }
  return made;
}

FLEXEL_INLINE Lanes cofactor(const Nine& m, int i, int j) {
  const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
  return m.at[i1][j1] * m.at[i2][j2] - m.at[i1][j2] * m.at[i2][j1];
}

// Columns of the constants of points.
struct PointColumns {
  Three rest, normal;
  Lanes own_plane, radius;
  Three slopes[3];
  Lanes ball, broken;
};

FLEXEL_INLINE void read_points(const CarriedPoint* points, const Block& block, PointColumns& made) {
  Lanes c[8];
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(points[block.at[l]].rest);
  transpose(c);
  made.rest = {c[0], c[1], c[2]};
  made.normal = {c[3], c[4], c[5]};
  made.own_plane = c[6];
  made.radius = c[7];
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(points[block.at[l]].slopes);
  transpose(c);
  made.slopes[0] = {c[0], c[1], c[2]};
  made.slopes[1] = {c[3], c[4], c[5]};
  const Lanes x = c[6], y = c[7];
  for (std::size_t l = 0; l < kLanes; ++l)
    c[l] = load(points[block.at[l]].slopes + 8);  // and what follows them
  transpose(c);
  made.slopes[2] = {x, y, c[0]};
  made.ball = c[1];
  made.broken = c[2];
}

// ContactSurface::shape_at(): F^-1, whether there is none, and the rate.
FLEXEL_INLINE void find_shape(Nine f, const PointColumns& point, Nine& inverse, LaneMask& shapeless,
                              Lanes& rate) {
  const Lanes infinite = Lanes{} + __builtin_huge_val();
  const auto& m = f.at;
  Lanes stretch = (m[0][0] * m[0][0] + m[1][0] * m[1][0]) + m[2][0] * m[2][0];
  stretch += (m[0][1] * m[0][1] + m[1][1] * m[1][1]) + m[2][1] * m[2][1];
  stretch += (m[0][2] * m[0][2] + m[1][2] * m[1][2]) + m[2][2] * m[2][2];
  const Lanes volume = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                       m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                       m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const LaneMask is_ball = point.ball != 0;
  shapeless = ~is_ball & ((point.broken != 0) | ~((volume > kLeastVolume) & (stretch < kMostStretch)));
  const LaneMask given = shapeless | is_ball;
  const Lanes first[3] = {cofactor(f, 0, 0), cofactor(f, 1, 0), cofactor(f, 2, 0)};
  const Lanes scale = 1 / (first[0] * m[0][0] + first[1] * m[1][0] + first[2] * m[2][0]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      inverse.at[j][i] =
          pick(given, Lanes{} + (i == j ? 1.0 : 0.0), (j == 0 ? first[i] : cofactor(f, i, j)) * scale);
  Lanes column = {}, row = {};
  for (int i = 0; i < 3; ++i) {
    const auto& v = inverse.at;
    column = larger(column, absolute(v[0][i]) + absolute(v[1][i]) + absolute(v[2][i]));
    row = larger(row, absolute(v[i][0]) + absolute(v[i][1]) + absolute(v[i][2]));
  }
  rate = pick(shapeless | (volume < 3 * kLeastVolume) | (stretch > 0.5 * kMostStretch), infinite,
              square_root(column * row));
  rate = pick(is_ball, Lanes{}, rate);
}

void place(const CarriedPoint* points, const std::uint32_t* which, std::size_t count,
           const double* displacement, double* states) {
  for (std::size_t begin = 0; begin < count; begin += kLanes) {
    const Block block = block_of(which, begin, count);
    Interpolated moved;
    interpolate(points, block, displacement, moved);
    PointColumns point;
    read_points(points, block, point);
    Nine f = gradient(moved, point.slopes), inverse;
    for (int i = 0; i < 3; ++i) f.at[i][i] = 1.0 + f.at[i][i];
    LaneMask shapeless;
    Lanes rate;
    find_shape(f, point, inverse, shapeless, rate);
    const auto& v = inverse.at;
    const Three& n = point.normal;
    const Three turned = {v[0][0] * n.x + v[1][0] * n.y + v[2][0] * n.z,
                          v[0][1] * n.x + v[1][1] * n.y + v[2][1] * n.z,
                          v[0][2] * n.x + v[1][2] * n.y + v[2][2] * n.z};
    const LaneMask none = shapeless | (point.ball != 0);
    const Three normal =
        pick(none, Three{Lanes{}, Lanes{}, Lanes{}}, turned / square_root(dot(turned, turned)));
    const Three position = point.rest + moved.value;
    const Lanes flag_bits = bits_of(shapeless & 1);
    Lanes side[8] = {position.x,
                     position.y,
                     position.z,
                     normal.x,
                     normal.y,
                     normal.z,
                     pick(none, Lanes{}, point.own_plane),
                     point.radius};
    Lanes shape[8] = {v[0][0], v[1][0], v[2][0], v[0][1], v[1][1], v[2][1], v[0][2], v[1][2]};
    Lanes rest[8] = {v[2][2], flag_bits, rate, Lanes{}, Lanes{}, Lanes{}, Lanes{}, Lanes{}};
    transpose(side);
    transpose(shape);
    transpose(rest);
    for (std::size_t l = 0; l < block.count; ++l) {
      double* to = states + kPointRow * block.at[l];
      store(to, side[l]);
      store(to + 8, shape[l]);
      store(to + 16, rest[l]);
    }
  }
}

// The two sides of eight pairs.
struct Sides {
  Three position[2], normal[2];
  Lanes own_plane[2], radius[2];
  LaneMask plane;
};

FLEXEL_INLINE void read_sides(const PairView& pairs, const Block& block, Sides& made) {
  Lanes i[8], j[8];
  Lanes planes = {};
  for (std::size_t l = 0; l < kLanes; ++l) {
    const PairSides& of = pairs.sides[block.at[l]];
    i[l] = load(pairs.points + kPointRow * of.i);
    j[l] = load(of.of_plane ? pairs.planes + kSideRow * of.j : pairs.points + kPointRow * of.j);
    planes[l] = of.of_plane;
  }
  transpose(i);
  transpose(j);
  made.position[0] = {i[0], i[1], i[2]};
  made.normal[0] = {i[3], i[4], i[5]};
  made.position[1] = {j[0], j[1], j[2]};
  made.normal[1] = {j[3], j[4], j[5]};
  const LaneMask plane = planes != 0;  // the foot on it; its normal is the exact one
  made.plane = plane;
  const Lanes height = dot(made.position[0] - made.position[1], made.normal[1]);
  made.position[1] = pick(plane, made.position[0] - height * made.normal[1], made.position[1]);
  made.own_plane[0] = pick(plane, Lanes{}, i[6]);
  made.own_plane[1] = j[6];
  made.radius[0] = i[7];
  made.radius[1] = j[7];
}

// In the order of PairConstants.
struct Constants {
  Lanes stiffness, width, facing_from, facing_fully, limit, soft, hard, ahead;
};

FLEXEL_INLINE Constants read_constants(const PairView& pairs, const Block& block) {
  Lanes c[8];
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(pairs.pairs + kPairRow * block.at[l]);
  transpose(c);
  return {c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]};
}

// What follows them in a ContactPair.
struct Surfaces {
  Lanes friction, pull_off, farthest_soft, rest_overlap;
};

FLEXEL_INLINE Surfaces read_surfaces(const PairView& pairs, const Block& block) {
  Lanes c[8];
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(pairs.pairs + kPairRow * block.at[l] + kConstantsRow);
  transpose(c);
  return {c[0], c[1], c[2], c[3]};
}

// Of PairRecord.
struct Records {
  Three slip;
  Lanes soft;
};

FLEXEL_INLINE Records read_records(const double* records, const Block& block) {
  Lanes c[8];
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(records + kRecordRow * block.at[l]);
  transpose(c);
  return {{c[1], c[2], c[3]}, c[7]};
}

struct Smooth {
  Lanes value, slope;
};

FLEXEL_INLINE Smooth kernel(const Lanes& squared, const Lanes& width) {
  const Lanes per_square = 1 / (width * width);
  const Lanes q = 1 - squared * per_square;
  const Lanes scale = (3 / 3.14159265358979323846) * per_square;
  const LaneMask flat = ~(width > 0), none = ~flat & ~(q > 0);
  return {pick(flat, Lanes{} + 1, pick(none, Lanes{}, scale * q * q)),
          pick(flat | none, Lanes{}, -2 * scale * q * per_square)};
}

FLEXEL_INLINE Smooth ramp(const Lanes& at, const Lanes& from, const Lanes& to) {
  const Lanes per_length = 1 / (to - from);
  const Lanes s = (at - from) * per_length;
  const LaneMask below = s <= 0, above = s >= 1;
  return {pick(below, Lanes{}, pick(above, Lanes{} + 1, s * s * (3 - 2 * s))),
          pick(below | above, Lanes{}, 6 * s * (1 - s) * per_length)};
}

// Columns of PairState.
struct Evaluated {
  LaneMask near, deep;
  Three normal, offset, force, turning[2];
  Lanes gap, weight, energy, pressure, stiffness, share, along, length, narrowing, facing_slope;
};

// press() under the law of `soft` and `ahead`.
FLEXEL_INLINE void press(Evaluated& now, const Sides& side, const Lanes& soft, const Lanes& hard,
                         const Lanes& ahead) {
  const Lanes depth = -now.gap, delta = depth + ahead;
  const LaneMask inside = depth > 0, touches = delta > 0, softly = delta < soft;
  const Lanes hardening = pick(inside, depth * depth / (hard * hard), Lanes{});
  Lanes energy = pick(inside, 0.25 * hardening * depth * depth, Lanes{});
  Lanes pressure = pick(inside, hardening * depth, Lanes{});
  const Lanes share = delta / soft;
  energy += pick(
      touches,
      pick(softly, (1.0 / 6) * delta * delta * share, 0.5 * delta * (delta - soft) + (1.0 / 6) * soft * soft),
      Lanes{});
  pressure += pick(touches, pick(softly, 0.5 * delta * share, delta - 0.5 * soft), Lanes{});
  const LaneMask presses = pressure > 0;
  now.stiffness = now.weight * pick(inside, 1 + 3 * hardening, Lanes{} + 1);
  now.share = pick(presses, pick(share < 0, Lanes{}, pick(share > 1, Lanes{} + 1, share)), Lanes{});
  energy = pick(presses, energy, Lanes{});
  now.energy = now.weight * energy;
  now.pressure = now.weight * pick(presses, pressure, Lanes{});
  const Three none = {Lanes{}, Lanes{}, Lanes{}};
  const Lanes spread = now.narrowing * energy;  // N/m, of t
  now.force = pick(presses, now.pressure * now.normal + spread * now.offset, none);
  const Three tilt = ((spread * now.along - now.pressure) / now.length) * now.offset;
  const LaneMask tilts = presses & (now.length > 0), turns = presses & (now.facing_slope > 0);
  now.turning[0] = pick(tilts, side.own_plane[0] * tilt, none);
  now.turning[1] = pick(tilts, (-side.own_plane[1]) * tilt, none);
  const Lanes turn = now.facing_slope * energy;
  now.turning[0] = pick(turns, now.turning[0] - turn * side.normal[1], now.turning[0]);
  now.turning[1] = pick(turns, now.turning[1] - turn * side.normal[0], now.turning[1]);
}

FLEXEL_INLINE void evaluate_block(const Sides& side, const Constants& k, const Lanes& allowed,
                                  const Lanes& wider, Evaluated& now) {
  const Three d = side.position[1] - side.position[0];
  const Lanes far = larger(k.limit, k.width);
  now.near = ~((k.width > 0) & (dot(d, d) > k.width * k.width + far * far));
  const LaneMask faces = ~is_zero(side.normal[0]) & ~is_zero(side.normal[1]);
  const Smooth ramped = ramp(-dot(side.normal[0], side.normal[1]), k.facing_from, k.facing_fully);
  const Smooth facing = {pick(faces, ramped.value, Lanes{} + 1), pick(faces, ramped.slope, Lanes{})};
  now.near &= facing.value > 0;
  const Three b = side.own_plane[0] * side.normal[0] - side.own_plane[1] * side.normal[1];
  const Lanes length = square_root(dot(b, b));
  const LaneMask balls = (side.radius[0] > 0) & (side.radius[1] > 0);
  now.near &= balls | (length > 0);
  const Lanes distance = dot(d, d);
  now.normal = (1 / length) * b;
  if (any(balls)) now.normal = pick(balls, pick(distance > 0, d / square_root(distance), d), now.normal);
  now.along = dot(d, now.normal);
  now.gap = now.along - side.radius[0] - side.radius[1] + allowed;
  now.offset = pick(balls, Three{Lanes{}, Lanes{}, Lanes{}}, d - now.along * now.normal);
  const Smooth kern = kernel(dot(now.offset, now.offset), k.width);
  now.near &= kern.value > 0;
  now.deep = now.gap < -k.limit;
  now.weight = k.stiffness * kern.value * facing.value;
  now.length = pick(balls, Lanes{}, length);
  now.narrowing = -2 * k.stiffness * kern.slope * facing.value;
  now.facing_slope = k.stiffness * kern.value * facing.slope;
  const LaneMask softens = wider > k.soft;
  press(now, side, pick(softens, wider, k.soft), k.hard, pick(softens, 0.5 * (wider - k.soft), k.ahead));
}

// As rows; of what is not near only that, of what is deep only the gap and where it is.
FLEXEL_INLINE void write_states(Evaluated& now, const Block& block, double* states) {
  const LaneMask pressing = now.near & ~now.deep;
  const Three none = {Lanes{}, Lanes{}, Lanes{}};
  const auto kept = [&](const Lanes& value) { return pick(pressing, value, Lanes{}); };
  const Three force = pick(pressing, now.force, none), on_i = pick(pressing, now.turning[0], none),
              on_j = pick(pressing, now.turning[1], none), &n = now.normal, &t = now.offset;
  const Lanes flag_bits = bits_of((now.near & 1) | (now.near & now.deep & 0x100));
  Lanes rows[4][8] = {
      {force.x, force.y, force.z, on_i.x, on_i.y, on_i.z, on_j.x, on_j.y},
      {on_j.z, n.x, n.y, n.z, t.x, t.y, t.z, now.gap},
      {kept(now.weight), kept(now.energy), kept(now.pressure), kept(now.stiffness), kept(now.share),
       now.along, kept(now.length), kept(now.narrowing)},
      {kept(now.facing_slope), flag_bits, Lanes{}, Lanes{}, Lanes{}, Lanes{}, Lanes{}, Lanes{}}};
  for (auto& row : rows) transpose(row);
  for (std::size_t l = 0; l < block.count; ++l) {
    double* to = states + kStateRow * block.at[l];
    for (std::size_t part = 0; part < 4; ++part) store(to + 8 * part, rows[part][l]);
  }
}

// PointMotion of one side of eight pairs.
struct Motion {
  Three velocity;
  Lanes gradient[9];
};

FLEXEL_INLINE Motion read_motion(const double* motions, const std::uint32_t at[kLanes]) {
  Lanes a[8], b[8];
  for (std::size_t l = 0; l < kLanes; ++l) {
    a[l] = load(motions + kMotionRow * at[l]);
    b[l] = load(motions + kMotionRow * at[l] + 8);
  }
  transpose(a);
  transpose(b);
  return {{a[0], a[1], a[2]}, {a[3], a[4], a[5], a[6], a[7], b[0], b[1], b[2], b[3]}};
}

FLEXEL_INLINE Three velocity_at(const Motion& of, const Three& away) {
  const Lanes* g = of.gradient;
  return {of.velocity.x + (g[0] * away.x + g[3] * away.y + g[6] * away.z),
          of.velocity.y + (g[1] * away.x + g[4] * away.y + g[7] * away.z),
          of.velocity.z + row_sum(2, g[2] * away.x, g[5] * away.y, g[8] * away.z)};
}

// Both sides of eight pairs, and where they meet, from each of them: share d, (share - 1) d; on a plane at the point.
struct Meeting {
  Motion of[2];
  Three d;
  Lanes share;
  LaneMask plane;
};

// A ball meets at its centre, which alone can carry a force; a shapeless point likewise. Both have no normal.
FLEXEL_INLINE void read_meeting(const PairView& pairs, const Block& block, const Sides& side,
                                const double* motions, Meeting& made) {
  std::uint32_t i[kLanes], j[kLanes];
  for (std::size_t l = 0; l < kLanes; ++l) {
    const PairSides& of = pairs.sides[block.at[l]];
    i[l] = of.i;
    j[l] = of.of_plane ? of.i : of.j;
  }
  const Three zero = {Lanes{}, Lanes{}, Lanes{}};
  made.of[0] = read_motion(motions, i);
  made.of[1] = read_motion(motions, j);
  made.plane = side.plane;
  made.d = pick(made.plane, zero, side.position[1] - side.position[0]);
  const LaneMask centred_i = is_zero(side.normal[0]), centred_j = is_zero(side.normal[1]);
  made.share = pick(centred_i == centred_j, Lanes{} + 0.5, pick(centred_i, Lanes{}, Lanes{} + 1));
}

// m/s, of j against i.
FLEXEL_INLINE Three between(const LaneMask& plane, const Three& of_i, const Three& of_j) {
  return pick(plane, Three{-of_i.x, -of_i.y, -of_i.z}, of_j - of_i);
}

constexpr double kSoftSteps = 2;      // in which an impact goes through the soft part of the contact law
constexpr double kHardening = 0.001;  // a step, of what rests: the share of its extra softness that goes
constexpr double kHardened = 1.01;    // of the least softness, at which that is over

// m, of the soft part of pairs in the steps to come, or 0: that of the law. A pair that will press within kSoftSteps
// gets one as wide as its way in them, but does not press where it is. One that is pressed keeps its own, for the
// energy it has stored is of that, and hardens slowly as it rests. It depends on the present state alone, for which
// pairs sleep a run that goes on from a checkpoint need not know.
FLEXEL_INLINE Lanes softness_after(const Evaluated& now, const LaneMask& presses, const Constants& k,
                                   const Lanes& soft, const Lanes& farthest, const Lanes& nearing,
                                   double drift) {
  const Lanes hardened = soft - kHardening * (soft - k.soft);
  const Lanes way = (kSoftSteps * drift) * nearing;
  const Lanes chosen = smaller(way, smaller(k.soft + 2 * larger(now.gap, Lanes{}), farthest));
  return pick(presses, pick(hardened < kHardened * k.soft, Lanes{}, hardened),
              pick(now.near & ~now.deep & ~(now.gap > way) & (chosen > k.soft), chosen, Lanes{}));
}

// To the softness after the step. Returns what that takes [J].
FLEXEL_INLINE Lanes soften(const Sides& side, const Constants& k, const Lanes& before, const Lanes& after,
                           Evaluated& now) {
  const LaneMask changed = now.near & ~now.deep & (after != before);
  if (!any(changed)) return Lanes{};
  const Lanes energy = now.energy;
  const LaneMask softens = after > k.soft;
  press(now, side, pick(softens, after, k.soft), k.hard, pick(softens, 0.5 * (after - k.soft), k.ahead));
  return pick(changed, energy - now.energy, Lanes{});
}

FLEXEL_INLINE Three at_most(const Three& value, const Lanes& most) {
  const Lanes norm = square_root(dot(value, value));
  return pick(norm > most, (most / norm) * value, value);
}

constexpr double kTangential = 0.8;  // as in simulate/contact/contact_friction.h

// Friction and damping; slips in `record` are brought up to date.
FLEXEL_INLINE Three rub(const Evaluated& now, const LaneMask& presses, const Meeting& meeting,
                        const Lanes& friction, const PairStep& step, Three& slip) {
  const Three zero = {Lanes{}, Lanes{}, Lanes{}};
  Three velocity = between(meeting.plane, velocity_at(meeting.of[0], meeting.share * meeting.d),
                           velocity_at(meeting.of[1], (meeting.share - 1) * meeting.d));
  const Lanes secant = larger(pick(now.share < 1, Lanes{}, now.pressure / -now.gap), now.weight);
  const Lanes most = friction * now.pressure;
  if (step.drift >= 0) {
    slip = slip + (Lanes{} + step.drift) * velocity;
    slip = slip - dot(slip, now.normal) * now.normal;
    slip = pick(presses & (friction > 0), at_most(slip, most / (kTangential * secant)), zero);
  }
  if (!(step.damping > 0)) velocity = zero;
  const Lanes separating = dot(velocity, now.normal);
  const Lanes along = larger(-step.damping * now.stiffness * now.share * separating, -now.pressure);
  const Three held = slip + (Lanes{} + step.damping) * (velocity - separating * now.normal);
  return pick(presses, along * now.normal - at_most((kTangential * secant) * held, most), zero);
}

FLEXEL_INLINE void write_rubbing(const Three& force, const Meeting& meeting, const Block& block,
                                 double* rubbing) {
  Lanes rows[8] = {force.x, force.y, force.z, meeting.d.x, meeting.d.y, meeting.d.z, meeting.share, Lanes{}};
  transpose(rows);
  for (std::size_t l = 0; l < block.count; ++l) store(rubbing + kRubbingRow * block.at[l], rows[l]);
}

// Of pairs that do not stick.
FLEXEL_INLINE void write_slips(const Three& slip, const Lanes& pull_off, const Block& block,
                               double* records) {
  Lanes rows[8] = {slip.x, slip.y, slip.z, Lanes{}, Lanes{}, Lanes{}, Lanes{}, Lanes{}};
  transpose(rows);
  for (std::size_t l = 0; l < block.count; ++l)
    if (!(pull_off[l] > 0))
      __builtin_memcpy(records + kRecordRow * block.at[l] + 1, &rows[l], 3 * sizeof(double));
}

// Of the block from `begin` on, whose states are `now`. Returns the energy that is lost [J].
FLEXEL_INLINE Lanes go_through(const PairView& pairs, const PairStep& step, const Block& block,
                               const Sides& side, const Constants& k, const Surfaces& surfaces,
                               Records& record, Evaluated& now) {
  Meeting meeting;
  read_meeting(pairs, block, side, step.motions, meeting);
  Lanes lost = {};
  if (step.drift >= 0) {
    const Three nearing = between(meeting.plane, meeting.of[0].velocity, meeting.of[1].velocity);
    const LaneMask presses = now.near & ~now.deep & (now.pressure > 0);
    const Lanes soft = softness_after(now, presses, k, record.soft, surfaces.farthest_soft,
                                      -dot(nearing, now.normal), step.drift);
    lost = soften(side, k, record.soft, soft, now);
    for (std::size_t l = 0; l < block.count; ++l) step.records[kRecordRow * block.at[l] + 7] = soft[l];
  }
  if (!step.rubbing) return lost;
  const LaneMask presses = now.near & ~now.deep & (now.pressure > 0);
  write_rubbing(rub(now, presses, meeting, surfaces.friction, step, record.slip), meeting, block,
                step.rubbing);
  if (step.drift >= 0) write_slips(record.slip, surfaces.pull_off, block, step.records);
  return lost;
}

void evaluate(const PairView& pairs, const double* allowed, const PairStep& step, double* states) {
  for (std::size_t begin = 0; begin < pairs.count; begin += kLanes) {
    const Block block = block_of(pairs.which, begin, pairs.count);
    const Surfaces surfaces = read_surfaces(pairs, block);
    Records record = read_records(step.records, block);
    Lanes permitted = surfaces.rest_overlap;
    for (std::size_t l = 0; allowed && l < block.count; ++l) permitted[l] = allowed[begin + l];
    Sides side;
    read_sides(pairs, block, side);
    const Constants k = read_constants(pairs, block);
    Evaluated now;
    evaluate_block(side, k, permitted, record.soft, now);
    Lanes lost = {};
    if (step.motions) lost = go_through(pairs, step, block, side, k, surfaces, record, now);
    write_states(now, block, states);
    const LaneMask touches = now.near & ~now.deep;
    const LaneMask marks = (touches & (now.pressure > 0) & kPresses) |
                           (touches & (now.stiffness > kStiffening * now.weight) & kStiffens) |
                           ((lost != 0) & kHardens);
    for (std::size_t l = 0; l < block.count; ++l) {
      step.marks[begin + l] = static_cast<std::uint8_t>(marks[l]);
      step.lost[begin + l] = lost[l];
    }
  }
}

// When a pair can press at the earliest, in the terms of simulate/contact/pairs/pair_law.h. Beside a common way points
// go by at most kPoint times their bodies' paths; normals change by at most |F^-1| times their bodies' turns, and the
// direction of contact, the mean of both, by twice the larger of these over its length. Gap, offset and facing change
// accordingly; half of what there is may be used up by either. kBounds covers that F^-1 changes meanwhile, by turns up
// to kMostTurn over it: integral of dx / (1 - x) < kBounds x. What has no sure normal is known by its distance alone.
struct Rates {
  Lanes fastest, turning;  // the larger of both sides'; likewise of those with a plane of their own
  LaneMask plane;
};

FLEXEL_INLINE Rates read_rates(const PairView& pairs, const Block& block, const Sides& side) {
  Lanes i = {}, j = {};
  for (std::size_t l = 0; l < kLanes; ++l) {
    const PairSides& of = pairs.sides[block.at[l]];
    i[l] = pairs.points[kPointRow * of.i + kNormalRate];
    j[l] = of.of_plane ? 0 : pairs.points[kPointRow * of.j + kNormalRate];
  }
  return {larger(i, j),
          larger(pick(side.own_plane[0] > 0, i, Lanes{}), pick(side.own_plane[1] > 0, j, Lanes{})),
          side.plane};
}

struct Safe {
  Lanes path, turn;
};

// A gap of `margin` that shrinks with the path and by `rate` with the turn.
FLEXEL_INLINE void bear(const LaneMask& where, const Lanes& margin, const Lanes& rate, const Lanes& fastest,
                        Safe& found) {
  const Lanes infinite = Lanes{} + __builtin_huge_val();
  const LaneMask turns = rate > 0;
  const Lanes path = pick(turns, 0.5 * margin / kPoint, margin / kPoint);
  const Lanes turn = pick(turns, smaller(0.5 * margin / rate, kMostTurn / fastest), infinite);
  const LaneMask better = where & (rate < infinite) & (smaller(path, turn) > smaller(found.path, found.turn));
  found.path = pick(better, path, found.path);
  found.turn = pick(better, turn, found.turn);
}

FLEXEL_INLINE LaneMask look_block(const Sides& side, const Constants& k, const Rates& rates,
                                  const Lanes& pressed, Safe& found) {
  constexpr double kRounding = 1e-9;
  const Lanes infinite = Lanes{} + __builtin_huge_val(), &width = k.width, &fastest = rates.fastest;
  const Three d = side.position[1] - side.position[0];
  const Three b = side.own_plane[0] * side.normal[0] - side.own_plane[1] * side.normal[1];
  const Lanes square = dot(d, d), distance = square_root(square), length = square_root(dot(b, b));
  const Lanes far = larger(width, k.limit);
  const LaneMask balls = (side.radius[0] > 0) & (side.radius[1] > 0), wide = width > 0;
  const LaneMask directed = ~balls & (length > 0);
  LaneMask near = balls | directed;
  found = {Lanes{}, infinite};
  bear(wide, distance - square_root(width * width + far * far), Lanes{}, fastest, found);
  bear(balls, distance - side.radius[0] - side.radius[1] - pressed, Lanes{}, fastest, found);
  const Lanes along = dot(d, b) / length;
  const Lanes rate = pick(rates.plane, Lanes{},
                          pick(fastest < infinite, 2 * kBounds * distance * rates.turning / length, fastest));
  const Lanes offset2 = square - along * along;
  bear(directed, along - side.radius[0] - side.radius[1] - pressed, rate, fastest, found);
  near &= ~(directed & wide & (offset2 > width * width + kRounding * (width * width + square)));
  bear(directed & wide, square_root(larger(offset2, Lanes{})) - width, 2 * rate, fastest, found);
  const LaneMask faces = ~is_zero(side.normal[0]) & ~is_zero(side.normal[1]);
  const Lanes facing = -dot(side.normal[0], side.normal[1]);
  near &= ~(faces & ~(facing > k.facing_from));
  const Lanes margin = smaller((k.facing_from - facing) / kBounds, Lanes{} + kMostTurn) / fastest;
  const LaneMask turned =
      faces & (fastest < infinite) & (fastest > 0) & (margin > smaller(found.path, found.turn));
  found.path = pick(turned, infinite, found.path);
  found.turn = pick(turned, margin, found.turn);
  return near;
}

void look(const PairView& pairs, const double* pressed, double* path, double* turn, std::uint8_t* near) {
  for (std::size_t begin = 0; begin < pairs.count; begin += kLanes) {
    const Block block = block_of(pairs.which, begin, pairs.count);
    Lanes ahead = {};
    for (std::size_t l = 0; l < block.count; ++l) ahead[l] = pressed[begin + l];
    Sides side;
    read_sides(pairs, block, side);
    Safe found;
    const LaneMask may =
        look_block(side, read_constants(pairs, block), read_rates(pairs, block, side), ahead, found);
    for (std::size_t l = 0; l < block.count; ++l) {
      path[begin + l] = found.path[l];
      turn[begin + l] = found.turn[l];
      near[begin + l] = may[l] != 0;
    }
  }
}

// What a state knows of the cells of points.
FLEXEL_INLINE Nine read_inverse(const double* states, const Block& block) {
  Lanes c[8];
  Nine made;
  for (std::size_t l = 0; l < kLanes; ++l) c[l] = load(states + kPointRow * block.at[l] + kInverse);
  transpose(c);
  for (int n = 0; n < 8; ++n) made.at[n % 3][n / 3] = c[n];
  Lanes last = {};
  for (std::size_t l = 0; l < kLanes; ++l) last[l] = states[kPointRow * block.at[l] + kInverse + 8];
  made.at[2][2] = last;
  return made;
}

void move(const CarriedPoint* points, const std::uint32_t* which, std::size_t count, const double* velocity,
          const double* states, double* motions) {
  for (std::size_t begin = 0; begin < count; begin += kLanes) {
    const Block block = block_of(which, begin, count);
    Interpolated moves;
    interpolate(points, block, velocity, moves);
    PointColumns point;
    read_points(points, block, point);
    const Nine rate = gradient(moves, point.slopes), inverse = read_inverse(states, block);
    Lanes g[9];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        g[i + 3 * j] = row_sum(i, rate.at[i][0] * inverse.at[0][j], rate.at[i][1] * inverse.at[1][j],
                               rate.at[i][2] * inverse.at[2][j]);
    Lanes first[8] = {moves.value.x, moves.value.y, moves.value.z, g[0], g[1], g[2], g[3], g[4]};
    Lanes second[8] = {g[5], g[6], g[7], g[8], Lanes{}, Lanes{}, Lanes{}, Lanes{}};
    transpose(first);
    transpose(second);
    for (std::size_t l = 0; l < block.count; ++l) {
      double* to = motions + kMotionRow * block.at[l];
      store(to, first[l]);
      store(to + 8, second[l]);
    }
  }
}

// ContactLoads: the load of a pair on its points, of which the second half is the rest of the couple.
void collect(const PairView& pairs, const double* states, const double* rubbing, double* loads) {
  constexpr LaneBits on_j = {0,  1,  2, 11,
                             12, 13, 7, 7};  // force, and from the third place on the second turning
  constexpr LaneBits force_0 = {0, 1, 2, 7, 7, 7, 0, 1}, way_0 = {7, 7, 7, 7, 7, 7, 3, 3};
  constexpr LaneBits force_1 = {2, 0, 1, 2, 0, 1, 2, 7}, way_1 = {3, 4, 4, 4, 5, 5, 5, 7};
  constexpr Lanes against = {-1, -1, -1, 1, 1, 1, 0, 0}, along = {1, 1, 1, 1, 1, 1, 0, 0};
  constexpr Lanes back = {-1, -1, -1, 0, 0, 0, 0, 0}, forth = {1, 1, 1, 0, 0, 0, 0, 0};
  for (std::size_t n = 0; n < pairs.count; ++n) {
    const std::size_t p = pairs.which[n];
    const PairSides& of = pairs.sides[p];
    Lanes i[2] = {}, j[2] = {};
    if (states) {
      const Lanes row = load(states + kStateRow * p);
      i[0] = against * row;
      j[0] = along * shuffle(row, load(states + kStateRow * p + 3), on_j);
    }
    if (rubbing) {
      const Lanes row = load(rubbing + kRubbingRow * p);
      const Lanes to_i = Lanes{} - row[6], to_j = Lanes{} + (row[6] - 1);
      const Lanes force[2] = {shuffle(row, row, force_0), shuffle(row, row, force_1)};
      const Lanes way[2] = {shuffle(row, row, way_0), shuffle(row, row, way_1)};
      i[0] += force[0] * (back + to_i * way[0]);
      i[1] += force[1] * (to_i * way[1]);
      j[0] += force[0] * (forth + to_j * way[0]);
      j[1] += force[1] * (to_j * way[1]);
    }
    const auto add = [&](std::uint32_t point, const Lanes* load_of) {
      double* to = loads + kLoadRow * point;
      store(to, load(to) + load_of[0]);
      if (rubbing) store(to + 8, load(to + 8) + load_of[1]);
    };
    add(of.i, i);
    if (!of.of_plane) add(of.j, j);
  }
}

// ContactLoads::on_elements(), summed.
FLEXEL_INLINE void add_to_elements(const CarriedPoint& point, const double* row, double* forces) {
  FourDoubles f, x, y, z, on[8];
  __builtin_memcpy(&f, row, sizeof f);
  __builtin_memcpy(&x, row + 4, sizeof x);
  __builtin_memcpy(&y, row + 8, sizeof y);
  __builtin_memcpy(&z, row + 12, sizeof z);
  for (int a = 0; a < 8; ++a) on[a] = point.weights[a] * f;
  const FourDoubles sum = x + y, difference = x - y;
  if (point.count == 8) {
    on[0] -= sum + z, on[1] += difference - z, on[2] -= difference + z, on[3] += sum - z;
    on[4] += z - sum, on[5] += difference + z, on[6] += z - difference, on[7] += sum + z;
  }
  for (std::uint32_t a = 0; a < point.count; ++a) {
    double* to = forces + 3 * std::size_t{point.elements[a]};
    store_three(to, load_stored_three(to) + on[a]);
  }
}

void spread(const CarriedPoint* points, const double* states, const std::uint32_t* which, std::size_t count,
            const double* loads, double* forces) {
  for (std::size_t begin = 0; begin < count; begin += kLanes) {
    const Block block = block_of(which, begin, count);
    Lanes a[8], b[8], c[8];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double* row = loads + kLoadRow * block.at[l];
      a[l] = load(row);
      b[l] = load(row + 8);
      c[l] = load(states + kPointRow * block.at[l]);
    }
    transpose(a);
    transpose(b);
    transpose(c);
    const Three turning = {a[3], a[4], a[5]}, normal = {c[3], c[4], c[5]};
    const Lanes couple[3][3] = {{a[6], b[1], b[4]}, {a[7], b[2], b[5]}, {b[0], b[3], b[6]}};
    PointColumns point;
    read_points(points, block, point);
    const Nine inverse = read_inverse(states, block);
    const auto& v = inverse.at;
    const Three across = turning - dot(turning, normal) * normal;
    const Lanes turned[3] = {v[0][0] * across.x + v[0][1] * across.y + v[0][2] * across.z,
                             v[1][0] * across.x + v[1][1] * across.y + v[1][2] * across.z,
                             row_sum(2, v[2][0] * across.x, v[2][1] * across.y, v[2][2] * across.z)};
    Lanes on[3][3];  // component, axis
    const Lanes n[3] = {normal.x, normal.y, normal.z};
    for (int i = 0; i < 3; ++i) {
      Three row;
      Lanes* to[3] = {&row.x, &row.y, &row.z};
      for (int j = 0; j < 3; ++j)
        *to[j] = n[i] * turned[j] +
                 row_sum(i, couple[i][0] * v[j][0], couple[i][1] * v[j][1], couple[i][2] * v[j][2]);
      for (int k = 0; k < 3; ++k)
        on[i][k] =
            row_sum(i, row.x * point.slopes[k].x, row.y * point.slopes[k].y, row.z * point.slopes[k].z);
    }
    Lanes first[8] = {a[0], a[1], a[2], Lanes{}, on[0][0], on[1][0], on[2][0], Lanes{}};
    Lanes second[8] = {on[0][1], on[1][1], on[2][1], Lanes{}, on[0][2], on[1][2], on[2][2], Lanes{}};
    transpose(first);
    transpose(second);
    for (std::size_t l = 0; l < block.count; ++l) {
      alignas(64) double row[16];
      store(row, first[l]);
      store(row + 8, second[l]);
      add_to_elements(points[block.at[l]], row, forces);
    }
  }
}

}  // namespace

#define FLEXEL_JOIN(a, b) a##b
#define FLEXEL_TABLE(isa) FLEXEL_JOIN(contacts_, isa)

const ContactTable& FLEXEL_TABLE(FLEXEL_ISA)() {
  static constexpr ContactTable table = {&place, &look, &evaluate, &move, &collect, &spread};
  return table;
}

}  // namespace flexel::simulate::contact_kernels
