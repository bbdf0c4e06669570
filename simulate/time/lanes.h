// Eight doubles at a time, by the compiler's vector extension: one instruction on AVX-512, two on AVX2, four
// on plain x86-64 or NEON, the same bits on all. Included by kernel.cpp alone.
#pragma once
#include <cstddef>
#include <cstdint>

namespace flexel::step {
namespace {

using Lanes = double __attribute__((vector_size(64)));
using LaneBits = long long __attribute__((vector_size(64)));
using LaneWords = unsigned long long __attribute__((vector_size(64)));  // bits that may run over
using LaneMask = decltype(Lanes{} > Lanes{});

#define FLEXEL_INLINE inline __attribute__((always_inline))

FLEXEL_INLINE Lanes load(const double* from) {
  Lanes value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}

FLEXEL_INLINE void store(double* to, const Lanes& value) {
  __builtin_memcpy(to, &value, sizeof value);
}

FLEXEL_INLINE Lanes gather(const double* from, const std::uint16_t* index) {
  return Lanes{from[index[0]], from[index[1]], from[index[2]], from[index[3]],
               from[index[4]], from[index[5]], from[index[6]], from[index[7]]};
}

FLEXEL_INLINE void scatter_add(double* to, const std::uint16_t* index, const Lanes& value) {
  for (int l = 0; l < 8; ++l) to[index[l]] += value[l];
}

FLEXEL_INLINE Lanes square_root(const Lanes& x) {
  Lanes root;
  for (int l = 0; l < 8; ++l) root[l] = __builtin_sqrt(x[l]);
  return root;
}

// Lane l is the one of a, b (0 to 7, 8 to 15) that `from` names for it; Clang knows no such built-in for
// vectors of indices.
FLEXEL_INLINE Lanes shuffle(const Lanes& a, const Lanes& b, const LaneBits& from) {
#if defined(__clang__)
  Lanes picked;
  for (int l = 0; l < 8; ++l) picked[l] = from[l] < 8 ? a[from[l]] : b[from[l] - 8];
  return picked;
#else
  return __builtin_shuffle(a, b, from);
#endif
}

FLEXEL_INLINE double sum(const Lanes& x) {
  return ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
}

// ln(1 + y) for y > -1 (any number for others), to a few units in the last place, also for small y. With 1 +
// y = 2^k m, m in [sqrt(1/2), sqrt(2)): k ln 2 + 2 artanh(f / (2 + f)), f = m - 1.
FLEXEL_INLINE Lanes log1p(const Lanes& y) {
  const Lanes whole = 1 + y;
  const LaneWords root_half = LaneWords{} + 0x3fe6a09e667f3bcdULL;
  LaneWords bits;
  __builtin_memcpy(&bits, &whole, sizeof bits);
  const LaneBits exponent = __builtin_convertvector(bits - root_half, LaneBits) >> 52;
  const LaneWords exponent_word = __builtin_convertvector(exponent, LaneWords);
  const LaneWords scaled_bits = bits - (exponent_word << 52);
  Lanes scaled;
  __builtin_memcpy(&scaled, &scaled_bits, sizeof scaled);
  // to double by the bits of 2^52 + 2^51 + k: vectors of integers have no conversion before AVX-512
  const LaneWords magic_bits = exponent_word + 0x4338000000000000ULL;
  Lanes magic;
  __builtin_memcpy(&magic, &magic_bits, sizeof magic);
  const Lanes k = magic - 6755399441055744.0;
  const Lanes f = exponent == 0 ? y : scaled - 1;
  const Lanes s = f / (2 + f);
  const Lanes z = s * s;
  Lanes p = 1.0 / 19 + z * (1.0 / 21);
#pragma GCC unroll 9
  for (int odd = 17; odd > 0; odd -= 2) p = 1.0 / odd + z * p;
  return k * 0.6931471805599453094 + 2 * s * p;
}

}  // namespace
}  // namespace flexel::step
