// Eight doubles or sixteen floats at a time by the compiler's vector extension, and functions that are
// compiled once per instruction set, of which the program takes the best that its machine has. Contraction is
// off, so the bits are the same on all.
#pragma once
#include <cstddef>
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

namespace flexel {

using Lanes = double __attribute__((vector_size(64)));
constexpr int kLanes = 8;
using FloatLanes = float __attribute__((vector_size(64)));
constexpr int kFloatLanes = 16;
using FourDoubles = double __attribute__((vector_size(32)));

FLEXEL_INLINE Lanes square_root(const Lanes& x) {
  Lanes root;
  for (int l = 0; l < kLanes; ++l) root[l] = __builtin_sqrt(x[l]);
  return root;
}

FLEXEL_INLINE FloatLanes square_root(const FloatLanes& x) {
  FloatLanes root;
  for (int l = 0; l < kFloatLanes; ++l) root[l] = __builtin_sqrtf(x[l]);
  return root;
}

template <class Vector>
FLEXEL_INLINE Vector load(const void* from) {
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

}  // namespace flexel
