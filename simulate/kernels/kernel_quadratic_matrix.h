// Matrices of cells of model `quadratic` and the factors of its Schwarz blocks, as plain data, eight side by side as in
// kernel_quadratic.h; kernel_quadratic_matrix.cpp is compiled once per instruction set.
#pragma once
#include "simulate/kernels/kernel_quadratic.h"

namespace flexel::simulate::quadratic_kernel {

// The lower triangle of a matrix of `nodes` nodes, by 3 x 3 blocks (row by row): that of nodes a >= b.
constexpr std::size_t block_place(std::size_t a, std::size_t b) {
  return 9 * (a * (a + 1) / 2 + b);
}
constexpr std::size_t block_triangle_size(std::size_t nodes) {
  return block_place(nodes, 0);
}
constexpr std::size_t kNodeMatrix = block_triangle_size(27), kCornerMatrix = block_triangle_size(8);

// moments (125 x 8): of the cells' matter -> stiffness in the cells' axes [N/m], over their 27 nodes (kNodeMatrix x 8) and of
// the trilinear field over their 8 corners (kCornerMatrix x 8).
using Matrices = void (*)(const double* moments, const Elasticity<double>& part, double* of_nodes,
                          double* of_corners);

// The lower triangle of a matrix of 81 rows, padded to 84, each as long as the last of its four.
constexpr std::size_t row_place(std::size_t row) {
  const std::size_t group = row / kRows;
  return kRows * (kRows * group * (group + 1) / 2 + row % kRows * (group + 1));
}
constexpr std::size_t kFactorSize = row_place(kRows * kGroups);

// matrix (kFactorSize x 8), lost: the lower triangles of positive matrices A -> of the first `count` lanes the inverse T of the
// Cholesky factor of D A D + raised, D = 1 / sqrt(diagonal): T^T T is the inverse. Bit l of what is returned: lane l is not
// positive, and to[l] was left.
using InvertFactors = unsigned (*)(double* matrix, double raised, std::size_t count, Triangle* to);

struct MatrixTable {
  Matrices matrices;
  InvertFactors invert_factors;
};

[[nodiscard]] const MatrixTable& matrices_portable();
[[nodiscard]] const MatrixTable& matrices_avx2();
[[nodiscard]] const MatrixTable& matrices_avx512();

[[nodiscard]] inline const MatrixTable& best_matrices() {
  static const MatrixTable& table = best_table(&matrices_portable, &matrices_avx2, &matrices_avx512);
  return table;
}

}  // namespace flexel::simulate::quadratic_kernel
