// Eight doubles or sixteen floats at a time by the compiler's vector extension: one instruction on AVX-512,
// two on AVX2, four on plain x86-64 or NEON, the same bits on all (contraction is off). Loops that are
// compiled for several instruction sets are either files that are compiled several times (FLEXEL_ISA,
// simulate/CMakeLists.txt), whose table of functions best_table() (base/instruction_set.h) chooses, or
// functions marked FLEXEL_CLONES, which the loader chooses. Everything here is internal to a file: no copy of
// one instruction set may stand in for another's.
#pragma once
#include <cstddef>
#include <cstdint>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

// No clones under the address sanitizer: it is not ready when their resolvers run.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define FLEXEL_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
// What needs an instruction that the compiler does not find by itself; for machines that have it.
#define FLEXEL_AVX512 __attribute__((target("avx512f")))
#else
#define FLEXEL_CLONES
#endif
#define FLEXEL_INLINE inline __attribute__((always_inline))

namespace flexel::simd {
namespace {

using Lanes = double __attribute__((vector_size(64)));
using LaneBits = long long __attribute__((vector_size(64)));
using LaneWords = unsigned long long __attribute__((vector_size(64)));  // bits that may run over
using LaneMask = decltype(Lanes{} > Lanes{});

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

// Lane l is lane from[l] of a, b (0 to 7, 8 to 15); Clang has no such built-in for
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

// exp(-x) for x from 0 on, to a few units in the last place; beyond 700 that of 700, some 1e-304. With x = k ln 2 - r,
// |r| <= ln 2 / 2: 2^-k times the series of exp(r).
FLEXEL_INLINE Lanes exp_minus(const Lanes& x) {
  const Lanes limited = x < 700 ? x : Lanes{} + 700;
  // rounded to whole numbers by adding 2^52 + 2^51, whose last bits are then k
  const Lanes magic = limited * 1.4426950408889634074 + 6755399441055744.0;
  const Lanes k = magic - 6755399441055744.0;
  const Lanes r = (k * 0x1.62e42fefa3800p-1 - limited) + k * 0x1.ef35793c76730p-45;  // ln 2 in two parts
  Lanes p = Lanes{} + 1;
#pragma GCC unroll 13
  for (int n = 13; n > 0; --n) p = 1 + r * p * (1.0 / n);
  LaneWords bits;
  __builtin_memcpy(&bits, &magic, sizeof bits);
  const LaneWords scale_bits = (1023 + 0x4338000000000000ULL - bits) << 52;
  Lanes scale;
  __builtin_memcpy(&scale, &scale_bits, sizeof scale);
  return scale * p;
}

constexpr int kLanes = 8;
using FloatLanes = float __attribute__((vector_size(64)));
constexpr int kFloatLanes = 16;
using FourDoubles = double __attribute__((vector_size(32)));

FLEXEL_INLINE FloatLanes square_root(const FloatLanes& x) {
  FloatLanes root;
  for (int l = 0; l < kFloatLanes; ++l) root[l] = __builtin_sqrtf(x[l]);
  return root;
}

template <class Vector>
FLEXEL_INLINE Vector load_as(const void* from) {
  Vector value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}

// Asks for the cache lines of [at, at + bytes). Processors that fetch ahead by themselves stop at the end of
// a page, which arrays of large records reach every few steps.
FLEXEL_INLINE void fetch(const void* at, std::size_t bytes) {
  constexpr std::size_t kLine = 64;
  for (std::size_t line = 0; line < bytes; line += kLine)
    __builtin_prefetch(static_cast<const char*>(at) + line);
}

// Writes past the caches, which spares reading what is overwritten; `to` is aligned to 16 bytes. What long
// arrays are filled with, to be read much later or never. finish_streams() before another thread reads them.
FLEXEL_INLINE void stream(double* to, const FourDoubles& value) {
#ifdef __SSE2__
  __m128d half[2];
  __builtin_memcpy(half, &value, sizeof value);
  _mm_stream_pd(to, half[0]);
  _mm_stream_pd(to + 2, half[1]);
#else
  __builtin_memcpy(to, &value, sizeof value);
#endif
}
FLEXEL_INLINE void finish_streams() {
#ifdef __SSE2__
  _mm_sfence();
#endif
}

}  // namespace
}  // namespace flexel::simd
