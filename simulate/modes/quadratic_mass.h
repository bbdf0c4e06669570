// The consistent mass of the cells of model `quadratic`, integrated over their matter exactly.
#pragma once
#include <array>
#include <vector>

#include "simulate/quadratic/quadratic_system.h"

namespace flexel::simulate {

// M_ab = rho int N_a N_b over the matter of a cell: of degree 4 along each axis, hence a sum over its moments; of what is no
// matter kOutside, as in the stiffness.
class QuadraticMass {
 public:
  // Keeps a reference.
  explicit QuadraticMass(const QuadraticSystem& system);
  // y = M x: kg m, x (nodes x 3) m; in parallel, the same bits for any thread count.
  void multiply(const double* x, double* y) const;

 private:
  using CellValues = std::array<double, kCellUnknowns>;
  void whole_cell(CellValues& values) const;
  void cut_cell(std::size_t cell, CellValues& values) const;

  const QuadraticSystem& system_;
  std::vector<double> mass_;                // (cells) kg, of a whole one
  std::array<double, 15> at_points_{};      // (5 x 3) shape functions along an axis at Gauss's points
  mutable std::vector<CellValues> forces_;  // (cells)
};

}  // namespace flexel::simulate
