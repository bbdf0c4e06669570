// What a lattice makes of a material: virtual tests of the models (`flexel measure`, docs/accuracy.md).
//
// Inside: the elasticity tensor of an unbounded lattice, from its energy under affine strains, and Young's
// modulus, Poisson's ratio and the shear modulus that it has along and across a direction.
//
// Bars: n x n x 4n cells (centre placement: elements) along the lattice, led so that the exact solution of a
// homogeneous bar fits: drawn (u_x given at the ends), sheared in a frame (ends and two sides led along
// themselves: u_x = gamma y / 2, u_y = gamma x / 2), bent (u_x = kappa x y), twisted (ends turned, free to
// warp: Saint-Venant). The moduli follow from the energy over that of the homogeneous bar, Poisson's ratio
// from the contraction of the drawn one. Strains that are even across a cell are the lattice's material at
// any n; those of bending and twisting vary inside a cell, and what that adds falls with n^2 (limit_of).
// Of `cells` the hourglass connections have one stiffness c = 8/3 mu h for all. It is that of bending at
// nu = 0, where a cell's q = kappa h^2 / 4 costs c q^2 / 2 = E kappa^2 h^5 / 24, as its matter does. A cell
// twisted by theta per length has two such q, theta h^2 / 4, and costs mu theta^2 h^5 / 6 where its matter
// costs half: over the whole section (1/6) / 0.1406 / n^2 = 1.19 / n^2 too much. Measured is 2.0 / n^2 in
// all; the rest is the warping within cells.
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
