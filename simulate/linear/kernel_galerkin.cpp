// A row of a block is one vector of eight doubles; each sum goes on in the order of the list, so that the
// bits are those of any instruction set (contraction is off).
#include "simulate/linear/kernel_galerkin.h"

#include "base/simd.h"

#ifndef FLEXEL_ISA
#error "compiled once per instruction set: simulate/CMakeLists.txt sets FLEXEL_ISA"
#endif

namespace flexel::simulate::galerkin_kernel {
namespace {

using namespace simd;

using Floats = float __attribute__((vector_size(32)));

FLEXEL_INLINE Lanes widened(const float* from) {
  Floats value;
  __builtin_memcpy(&value, from, sizeof value);
  return __builtin_convertvector(value, Lanes);
}

FLEXEL_INLINE Lanes widened(const double* from) {
  return load(from);
}

// Six sums side by side, one a column: each waits for itself alone.
template <class Number>
void row(const Number* blocks, const std::uint32_t* columns, std::size_t count, const double* x, double* to) {
  Lanes sums[6] = {};
  for (std::size_t t = 0; t < count; ++t) {
    const double* from = x + 6 * std::size_t{columns[t]};
    for (std::size_t c = 0; c < 6; ++c) sums[c] += from[c] * widened(blocks + 6 * (6 * t + c));
  }
  const Lanes sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + (sums[4] + sums[5]);
  for (std::size_t m = 0; m < 6; ++m) to[m] = sum[m];
}

template <std::size_t R>
void products(const Product* list, std::size_t count) {
  for (const Product* each = list; each != list + count; ++each) {
    Lanes p[R];
    for (std::size_t c = 0; c < R; ++c) p[c] = widened(each->p + 6 * c);
    for (std::size_t r = 0; r < R; ++r) {
      Lanes sum = load(each->sum + kWidth * r);
      for (std::size_t c = 0; c < R; ++c) sum += each->a[R == 3 ? R * r + c : R * c + r] * p[c];
      store(each->sum + kWidth * r, sum);
    }
  }
}

template <std::size_t R>
void pairs(const Pair* list, std::size_t count) {
  for (const Pair* each = list; each != list + count; ++each) {
    Lanes b[R];
    for (std::size_t c = 0; c < R; ++c) b[c] = load(each->b + kWidth * c);
    for (std::size_t m = 0; m < 6; ++m) {
      Lanes sum = load(each->sum + kWidth * m);
      for (std::size_t c = 0; c < R; ++c) sum += static_cast<double>(each->p[6 * c + m]) * b[c];
      store(each->sum + kWidth * m, sum);
    }
  }
}

void restriction(const float* blocks, const std::uint64_t* positions, const std::uint32_t* rows,
                 std::size_t count, const double* r, double* to) {
  Lanes sum = {};
  for (std::size_t t = 0; t < count; ++t) {
    const float* block = blocks + 36 * positions[t];
    const double* from = r + 6 * std::size_t{rows[t]};
    for (std::size_t c = 0; c < 6; ++c) sum += from[c] * widened(block + 6 * c);
  }
  for (std::size_t m = 0; m < 6; ++m) to[m] = sum[m];
}

void prolongation(const float* blocks, const std::uint32_t* columns, std::size_t count, const double* c,
                  double* x) {
  Lanes sums[6] = {};
  for (std::size_t t = 0; t < count; ++t) {
    const double* from = c + 6 * std::size_t{columns[t]};
    const Lanes entry = {from[0], from[1], from[2], from[3], from[4], from[5], 0, 0};
    for (std::size_t r = 0; r < 6; ++r) sums[r] += entry * widened(blocks + 6 * (6 * t + r));
  }
  for (std::size_t r = 0; r < 6; ++r) x[r] += simd::sum(sums[r]);
}

}  // namespace

const Table& FLEXEL_ISA() {
  static constexpr Table table = {
      &row<float>,  &row<double>, {&products<3>, &products<6>}, {&pairs<3>, &pairs<6>},
      &restriction, &prolongation};
  return table;
}

}  // namespace flexel::simulate::galerkin_kernel
