// What the kernels of model `quadratic` share: vectors over cells that lie side by side. Internal to a file, as base/simd.h is.
#pragma once
#include "base/simd.h"
#include "simulate/kernels/kernel_quadratic.h"

namespace flexel::simulate::quadratic_kernel {
namespace {

// As long as the registers: the compiler keeps longer ones in memory. The bits are the same.
#if defined(__AVX512F__)
constexpr std::size_t kBytes = 64;
#elif defined(__AVX2__)
constexpr std::size_t kBytes = 32;
#else
constexpr std::size_t kBytes = 16;
#endif
template <class Number>
constexpr std::size_t kLanes = kWidth * sizeof(Number) < kBytes ? kWidth : kBytes / sizeof(Number);

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
  return simd::load_as<Vector>(from + kWidth * place);
}

template <class Vector, class Number>
FLEXEL_INLINE void put(Number* to, std::size_t place, const Vector& value) {
  __builtin_memcpy(to + kWidth * place, &value, sizeof value);
}

}  // namespace
}  // namespace flexel::simulate::quadratic_kernel
