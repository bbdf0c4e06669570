// Products of the cells' tangent stiffness with displacements, as plain data: simulate/equilibrium/cell_stiffness.h cuts
// the body into the chunks of timed runs (simulate/kernels/chunk_layout.h) and prepares their tangents,
// simulate/kernels/kernel_product.cpp is the loop, compiled once per instruction set as kernel_table.cpp is.
#pragma once
#include "simulate/kernels/kernel.h"

namespace flexel::simulate::step {

// How the tangent dP/dH of a block's cells is held, in columns of kLanes doubles, lattice frame:
//   at_rest    not at all: dP = mu (H + H^T) + lambda tr(H) I
//   deformed   kHourglassColumns, c = mu - lambda ln J, added stress S (xx, yy, zz, xy, yz, zx) [Pa]:
//              dP = mu H + c G H^T G + lambda (G : H) G + H S
//   moduli     kHourglassColumns, dP/dH (9 x 9) [Pa]
// kHourglassColumns: G = F^-T (9, row by row), p_m = F^-1 q_m (3 of each of xy, yz, zx) [m], J, and the share that their
// forces have in the tangent: 1, or 0 where it is projected.
enum class TangentForm { at_rest, deformed, moduli };
constexpr std::size_t kTangentForms = 3;
constexpr std::size_t kHourglassColumns = 20;
constexpr std::size_t kTangentColumns[kTangentForms] = {0, kHourglassColumns + 7, kHourglassColumns + 81};

// y = K x on the elements that the chunk owns, K x on the others to chunk.shared_force; x, y (n x 3) N, m in
// the body's order, world frame. `tangent`: of the chunk's blocks. `scratch`: kProductColumns columns.
using ProductKernel = void (*)(const ChunkView& chunk, const double* tangent, const double* x, double* y,
                               double* scratch);
constexpr std::size_t kProductColumns = 6;  // x, K x

struct ProductTable {
  ProductKernel of[kTangentForms];
};

[[nodiscard]] const ProductTable& products_portable();
[[nodiscard]] const ProductTable& products_avx2();
[[nodiscard]] const ProductTable& products_avx512();

}  // namespace flexel::simulate::step
