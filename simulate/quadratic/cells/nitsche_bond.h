// Bonds of model `quadratic`: parts that touch are held together by Nitsche's method on their common surface, with weights and penalty
// from what each cell can bear (Annavarapu, Hautefeuille and Dolbow, Comput. Methods Appl. Mech. Engrg. 225, 2012).
//
// With the jump [u] = u_0 - u_1, n out of part 0, and {t(u)} = w_0 sigma_0 n + w_1 sigma_1 n,
//     a(u, v) = ... - int [{t(u)} . [v] + {t(v)} . [u]] + int beta [u] . [v],
//     w_0 = L_1 / (L_0 + L_1),  w_1 = L_0 / (L_0 + L_1),  beta = kBondNitsche L_0 L_1 / (L_0 + L_1),
// which the exact solution satisfies, whatever the two materials and spacings. L of a cell is the largest int |sigma n|^2 over its
// bonded surface for a strain energy of 1/2: so the traction is that of the softer, or fuller, of the two, and the form is
// positive from kBondNitsche = 4 on. Tractions turn with their cells (corotation.h), jumps are the world's.
#pragma once
#include "simulate/quadratic/cells/bonded_cells.h"
#include "simulate/quadratic/cells/cell_integrals.h"

namespace flexel::simulate {

constexpr double kBondNitsche = 5;

// What the terms of a pair of cells are made from.
struct BondSides {
  const BondedCells* pair = nullptr;
  std::array<const Lattice*, 2> lattice{};
  std::array<const Mat9*, 2> moduli{};  // Pa, world frame
  std::array<double, 2> weight{};       // w
  double penalty = 0;                   // Pa/m, beta
};

// Pa/m: L of a cell, from its elastic stiffness (81 x 81, N/m) and the surface points of all its bonds. `rest`: of its nodes [m].
[[nodiscard]] double bearing_limit(const CellMatrix& stiffness, const std::array<Vec3, kQuadraticNodes>& rest,
                                   const std::vector<const FacePoint*>& points, const Lattice& lattice,
                                   const Mat9& moduli);

// What the bond adds to the stiffness of the cell of one side, in the frame of a cell that is turned.
void add_own_stiffness(const BondSides& bond, std::size_t side, CellMatrix& matrix);
// Rows: the first cell; columns: the second; world frame.
[[nodiscard]] CellMatrix cross_stiffness(const BondSides& bond, const std::array<Mat3, 2>& rotation);

// N (27 x 3), on the nodes of either cell, to be taken from the loads. `u`: displacements; `local`: without the cells' rotations.
using NodeVectors = std::array<Vec3, kQuadraticNodes>;
[[nodiscard]] std::array<NodeVectors, 2> bond_forces(const BondSides& bond,
                                                     const std::array<NodeVectors, 2>& u,
                                                     const std::array<NodeVectors, 2>& local,
                                                     const std::array<Mat3, 2>& rotation);

// (27) whether the shape function of each node of one side is other than 0 on the surface.
[[nodiscard]] std::array<bool, kQuadraticNodes> nodes_of_surface(const BondedCells& pair, std::size_t side);

}  // namespace flexel::simulate
