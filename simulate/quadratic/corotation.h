// Large deflections of model `quadratic`: cells that turn with their matter (corotational formulation; Nour-Omid and
// Rankin, Comput. Methods Appl. Mech. Engrg. 93, 1991; Felippa and Haugen, CMAME 194, 2005).
//
// R is the rotation of F = I + grad u in the middle of a cell's matter (polar decomposition F = R U). With u^ what is left of
// the displacement once R is taken out, u^_a = R^T (x_a - x_0) - (X_a - X_0), the cell's energy is 1/2 u^ . K u^, K its exact
// linear stiffness. The forces are its derivatives,
//     f = R P^T K u^,  P = I + Y G,
// where G (3 x 81) gives the spin of R from the displacement and Y_a w = y_a x w with y_a = R^T (x_a - x_0). Strains have to
// stay small, rotations need not.
#pragma once
#include "simulate/quadratic/quadratic_system.h"

namespace flexel::simulate {

class Corotation {
 public:
  // Keeps references. `stiffness`: QuadraticSystem::stiffness(safety), whose cells are turned by turn().
  Corotation(const QuadraticSystem& system, QuadraticOperator& stiffness, double safety);
  Corotation(const Corotation&) = delete;
  Corotation& operator=(const Corotation&) = delete;

  // (nodes x 3) N: what is left of loads and forces of cells and supports at `share` of all loads and moves. Finds the
  // rotations; false where a cell is inside out.
  [[nodiscard]] bool residual(const std::vector<Vec3>& displacement, double share, std::vector<Vec3>& left);
  // Foretells the stresses that the tangent has after the next residual(): those of the last one, and what `change` (nodes x 3, m,
  // of `displacement`, the last) and `more` of the free strains add to first order. The true ones have what its second
  // order stretches, which soon outweighs the bending of a thin wall (Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
  // Engrg. 313, 2017: "mixed integration points").
  void foretell(const std::vector<Vec3>& displacement, const std::vector<Vec3>& change, double more);
  // N, the norm of loads and of what holds the part at the last displacement: what a residual is small beside. Where nothing acts,
  // 1e8 times what rounding leaves of the displacement.
  [[nodiscard]] double scale() const { return scale_; }
  // Makes `stiffness` the tangent at the last displacement. Without `stressed` the part of the stresses (geometric
  // stiffness), which may make it indefinite, is left out.
  void set_tangent(bool stressed);

  // y (nodes x 3) N = K_sigma x, the part of the stresses alone, at the last displacement; x (nodes x 3) m.
  void stress_forces(const double* x, double* y) const;

  // (cells) R - 1 of the last displacement.
  [[nodiscard]] const std::vector<Mat3>& turns() const { return from_rest_; }

 private:
  bool evaluate(std::size_t cell, const std::vector<Vec3>& displacement, double share);
  // (27 x 3) N: what its supports and their moves do to the nodes of a cell.
  [[nodiscard]] std::array<Vec3, kQuadraticNodes> support_forces(std::size_t cell,
                                                                 const std::vector<Vec3>& displacement,
                                                                 double share) const;
  // Takes from `left` what bonds hold the nodes of their cells with.
  void take_bonds(const std::vector<Vec3>& displacement, std::vector<Vec3>& left) const;

  const QuadraticSystem& system_;
  QuadraticOperator& stiffness_;
  double safety_;
  double scale_ = 0;             // N
  double stiffest_ = 0;          // N/m, of a cell
  std::vector<Mat3> from_rest_;  // (cells) R - 1
  std::vector<CellTurn>
      turn_;  // (cells) without the part of the stresses, which is stress_, to be added to `a`
  std::vector<CellTurn::Columns> stress_;
  std::vector<double> force_;             // (cells x 81) N, elastic
  std::vector<double> local_force_;       // (cells x 81) N, of K u^ and free strains, as the cell turned
  bool foretold_ = false;                 // local_force_ is of the displacement to come
  std::vector<std::uint32_t> supported_;  // cells that supports hold
};

}  // namespace flexel::simulate
