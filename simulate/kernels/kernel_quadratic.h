// The loops of model `quadratic`, as plain data; kernel_quadratic.cpp is compiled once per instruction set
// (the reasons are in simulate/kernels/kernel.h). Cells go eight side by side: number i of cell l is at 8 i + l.
#pragma once
#include <cstddef>
#include <cstdint>

#include "base/instruction_set.h"

namespace flexel::simulate::quadratic_kernel {

constexpr std::size_t kWidth = 8, kUnknowns = 81;

// Of the cells of a part, in the axes of its lattice.
template <class Number>
struct Elasticity {
  Number scale[3];  // 2 / spacing
  // Stress by strain (6 x 6: xx, yy, zz, xy, yz, zx; shear strains are twice the tensor's) [Pa], times the volume of
  // a voxel. `isotropic`: lambda is moduli[1], mu moduli[21].
  Number moduli[36];
  bool isotropic;
};

template <class Number>
struct EightCells {
  const Number* moments;    // (points x 8) weights of Gauss's points (formats/lattice/cell_moments.h)
  const Number* rotation;   // (9 x 8) row by row, from the world to the cells' axes; none: the same
  const Number *a, *gamma;  // (243 x 8) of CellTurn, in the cells' axes, 3 unknown + column; or none
};

// values (81 x 8): the displacement of the cells' nodes in the world frame [m] -> the forces that it takes [N].
template <class Number>
using Product = void (*)(const EightCells<Number>& cells, const Elasticity<Number>& part, Number* values);

// The lower triangle of a matrix, four rows at a time, each as long as the last of them, rounded up to eight: zeros behind
// the diagonal. A row is kept in steps of a 32,767th of its largest number.
constexpr std::size_t kRows = 4, kGroups = (kUnknowns + kRows - 1) / kRows, kPaddedUnknowns = 88;
constexpr int kMostSteps = 32767;
constexpr std::size_t group_columns(std::size_t group) {
  return (kRows * (group + 1) + kWidth - 1) / kWidth * kWidth;
}
constexpr std::size_t triangle_size() {
  std::size_t size = 0;
  for (std::size_t g = 0; g < kGroups; ++g) size += kRows * group_columns(g);
  return size;
}
struct Triangle {
  float step[kRows * kGroups];
  float scale[kPaddedUnknowns];  // of x and y
  std::int16_t steps[triangle_size()];
};

struct Table {
  // By the number of Gauss's points along an axis: 3 (whole cells), 5.
  Product<double> product[2];
  Product<float> product_of_floats[2];
  // y = D T^T T D x, D the scale; x and y have kPaddedUnknowns numbers, x is lost.
  void (*square)(const Triangle& triangle, float* x, float* y);
};

[[nodiscard]] const Table& portable();
[[nodiscard]] const Table& avx2();
[[nodiscard]] const Table& avx512();

[[nodiscard]] inline const Table& best() {
  static const Table& table = best_table(&portable, &avx2, &avx512);
  return table;
}

}  // namespace flexel::simulate::quadratic_kernel
