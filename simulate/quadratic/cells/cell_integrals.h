// Integrals over the matter of a 27-node cell, exactly from its moments (formats/lattice/cell_moments.h), which are the
// weights of Gauss's points.
#pragma once
#include <Eigen/Core>
#include <array>

#include "formats/lattice/cell_moments.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/kernels/kernel_quadratic.h"
#include "simulate/laws/elasticity.h"

namespace flexel::simulate {

constexpr int kCellUnknowns = 81;  // 3 n + axis
// Numbers of the lower triangle of a cell's matrix.
constexpr std::size_t kPackedSize = static_cast<std::size_t>(kCellUnknowns) * (kCellUnknowns + 1) / 2;
using CellMatrix = Eigen::Matrix<double, kCellUnknowns, kCellUnknowns>;
using Moments = Eigen::Matrix<double, static_cast<int>(kMoments), 1>;

// Of the cells of a part: `moduli` is A = dP/dF at rest in the world frame [Pa].
[[nodiscard]] quadratic_kernel::Elasticity<double> cell_elasticity(const Lattice& lattice,
                                                                   const Mat9& moduli);

// Integrals of the shape functions over a cell of that volume [m^3].
[[nodiscard]] std::array<double, kQuadraticNodes> shape_integrals(double voxel, const Moments& moments);
// Gauss's point whose weight moment k is, in cell coordinates.
[[nodiscard]] Vec3 gauss_point(std::size_t k);
// A : gradient [Pa].
[[nodiscard]] Mat3 stress_of(const Mat9& moduli, const Mat3& gradient);
// Middle of the matter, in cell coordinates.
[[nodiscard]] Vec3 middle_of(const Moments& moments);

[[nodiscard]] Moments whole_cell_moments();

}  // namespace flexel::simulate
