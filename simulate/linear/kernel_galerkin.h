// The sums of small blocks that the Galerkin product and the transfers between two levels consist of, as
// plain data; linear/kernel_galerkin.cpp is compiled once per instruction set (the reasons are in
// simulate/kernels/kernel.h). R: unknowns of a fine node, 3 or 6. Blocks of P are transposed (6 x R),
// column-major. Blocks of six rows may be read two numbers past their end. Rows of six are kept eight doubles
// wide, of which the last two mean nothing.
#pragma once
#include <cstddef>
#include <cstdint>

namespace flexel::simulate::galerkin_kernel {

constexpr std::size_t kWidth = 8;

// sum += a p^T: a block of A (R x R; 3 x 3 row-major, 6 x 6 column-major), one of P, one of A P (R x kWidth).
struct Product {
  const double* a;
  const float* p;
  double* sum;
};

// sum += p b: a block of P, one of A P (R x kWidth), one of the coarse matrix (6 x kWidth).
struct Pair {
  const float* p;
  const double* b;
  double* sum;
};

struct Table {
  // R = 6. One row of A x: sum (6) = sum over t of blocks[t] (column-major) times the entry columns[t] of x;
  // in single and in double precision.
  void (*row)(const float* blocks, const std::uint32_t* columns, std::size_t count, const double* x,
              double* sum);
  void (*row_of_doubles)(const double* blocks, const std::uint32_t* columns, std::size_t count,
                         const double* x, double* sum);
  // For R = 3 and 6; one after the other.
  void (*products[2])(const Product* list, std::size_t count);
  void (*pairs[2])(const Pair* list, std::size_t count);
  // R = 6. One row of P^T r: sum (6) = sum over t of the block at positions[t] times the entry rows[t] of r.
  void (*restriction)(const float* blocks, const std::uint64_t* positions, const std::uint32_t* rows,
                      std::size_t count, const double* r, double* sum);
  // R = 6. One row of P c: adds to x (6) the blocks, transposed, times the entries columns[t] of c.
  void (*prolongation)(const float* blocks, const std::uint32_t* columns, std::size_t count, const double* c,
                       double* x);
};

[[nodiscard]] const Table& portable();
[[nodiscard]] const Table& avx2();
[[nodiscard]] const Table& avx512();

}  // namespace flexel::simulate::galerkin_kernel
