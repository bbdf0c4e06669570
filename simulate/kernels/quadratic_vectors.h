// What the kernels of model `quadratic` share: vectors over cells that lie side by side. Internal to a file, as base/simd.h is.
#pragma once
#include "base/simd.h"

namespace flexel::simulate::quadratic_kernel {
namespace {

constexpr std::size_t kSideBySide = 8;  // cells: kWidth, which the files that include this hold it to

// As long as the registers: the compiler keeps longer ones in memory. The bits are the same.
#if defined(__AVX512F__)
constexpr std::size_t kBytes = 64;
#elif defined(__AVX2__)
constexpr std::size_t kBytes = 32;
#else
constexpr std::size_t kBytes = 16;
#endif
template <class Number>
constexpr std::size_t kLanes = kSideBySide * sizeof(Number) < kBytes ? kSideBySide : kBytes / sizeof(Number);

template <class Number>
struct VectorOf;
template <>
struct VectorOf<double> {
  using Type = double __attribute__((vector_size(sizeof(double) * kLanes<double>)));
};
template <>
struct VectorOf<float> {
  using Type = float __attribute__((vector_size(sizeof(float) * kLanes<float>)));
};

template <class Vector, class Number>
FLEXEL_INLINE Vector get(const Number* from, std::size_t place) {
  return simd::load_as<Vector>(from + kSideBySide * place);
}

template <class Vector, class Number>
FLEXEL_INLINE void put(Number* to, std::size_t place, const Vector& value) {
  __builtin_memcpy(to + kSideBySide * place, &value, sizeof value);
}

}  // namespace
}  // namespace flexel::simulate::quadratic_kernel
