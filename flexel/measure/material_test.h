// The effective elastic constants of a lattice: virtual material tests (`flexel measure`, docs/measurements/accuracy.md).
//
// Inside: the elasticity tensor of an unbounded lattice, from its energy under affine strains, and from it
// Young's modulus, Poisson's ratio and the shear modulus by direction.
//
// Bars: n x n x 4n cells (centre placement: elements) along the lattice, with boundary displacements of the
// exact solution of a homogeneous bar: drawn (u_x given at the ends), sheared in a frame (ends and two sides:
// u_x = gamma y / 2, u_y = gamma x / 2), bent (u_x = kappa x y), twisted (ends turned, free to warp:
// Saint-Venant). The moduli are the energy over that of the homogeneous bar, Poisson's ratio is the
// contraction of the drawn one. Where the strain is constant over a cell the result is the material at any n.
// Under bending and twisting it varies inside a cell, and the error falls as 1 / n^2 (limit_of).
//
// The hourglass connections of `cells` have the stiffness of the matter for pure bending and for twisting by mode
// (simulate/models/cell_model.h), so a bent bar is exact. A twisted one of section a x a has the energy of its matter but for
// the warping within the cells.
#pragma once
#include <vector>

#include "simulate/state/state.h"

namespace flexel::commands {

struct MeasuredDirection {
  Vec3 along = Vec3::UnitX(), across = Vec3::UnitY();  // unit, in the lattice's axes
  double young = 0;                                    // Pa, along
  double poisson = 0;                                  // -strain across over strain along
  double shear = 0;                                    // Pa, between the two
};

struct MeasuredBar {
  int cells = 0;                    // through the bar
  double tension = 0, bending = 0;  // Pa, Young's modulus
  double poisson = 0;
  double shear = 0, torsion = 0;  // Pa, shear modulus
};

// Directions [100], [110] and [111], each across two directions where they differ.
[[nodiscard]] std::vector<MeasuredDirection> measure_inside(simulate::Model model,
                                                            simulate::HookeConstant hooke,
                                                            const simulate::Material& material,
                                                            double spacing);

// `cells` even, at least 2.
[[nodiscard]] MeasuredBar measure_bar(simulate::Model model, simulate::HookeConstant hooke,
                                      const simulate::Material& material, double spacing, int cells);

// What bars of ever more cells come to, from two of them: an error that falls with the square of the spacing
// (Richardson 1911). For models whose order is two: cells, springs. `cells` of the result is 0.
[[nodiscard]] MeasuredBar limit_of(const MeasuredBar& coarse, const MeasuredBar& fine);

}  // namespace flexel::commands
