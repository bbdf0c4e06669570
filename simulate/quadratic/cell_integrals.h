// Integrals over the matter of a 27-node cell, exactly from its moments (formats/lattice/cell_moments.h).
#pragma once
#include <Eigen/Core>
#include <vector>

#include "formats/lattice/cell_moments.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/laws/elasticity.h"

namespace flexel::simulate {

constexpr int kCellUnknowns = 81;  // 3 n + axis
using CellMatrix = Eigen::Matrix<double, kCellUnknowns, kCellUnknowns>;
using Moments = Eigen::Matrix<double, static_cast<int>(kMoments), 1>;

// With A = dP/dF at rest, the stiffness of a cell is K_ab(i, k) = sum_jl A(3 i + j, 3 k + l) times the integral of
// d_j N_a d_l N_b. The integrals are linear in the moments.
class CellIntegrals {
 public:
  // Of the cells of a part: `moduli` is A in the world frame [Pa].
  CellIntegrals(const Lattice& lattice, const Mat9& moduli);

  // [N/m], symmetric; world frame, unknown 3 n + axis.
  [[nodiscard]] CellMatrix stiffness(const Moments& moments) const;
  // Integrals of the shape functions [m^3].
  [[nodiscard]] std::array<double, kQuadraticNodes> volumes(const Moments& moments) const;
  // Middle of the matter, in cell coordinates.
  [[nodiscard]] static Vec3 middle(const Moments& moments);

 private:
  Lattice lattice_;
  Mat9 moduli_;
  double volume_;  // m^3, of a voxel
};

[[nodiscard]] Moments whole_cell_moments();

}  // namespace flexel::simulate
