// What a lattice makes of a material: virtual tests of the models (`flexel measure`, docs/accuracy.md).
//
// Inside: the elasticity tensor of an unbounded lattice, from its energy under affine strains, and Young's
// modulus, Poisson's ratio and the shear modulus that it has along and across a direction.
//
// Bars: n x n x 4n cells (centre placement: elements) along the lattice, led at both ends so that the exact
// solution of a homogeneous bar fits: drawn (u_x given), bent (u_x = kappa x y), twisted (ends turned, free
// to warp: Saint-Venant). The moduli follow from the energy over that of the homogeneous bar, Poisson's ratio
// from the contraction of the drawn one.
#pragma once
#include <vector>

#include "simulate/state.h"

namespace flexel {

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
  double torsion = 0;  // Pa, shear modulus
};

// Directions [100], [110] and [111], each across two directions where they differ.
[[nodiscard]] std::vector<MeasuredDirection> measure_inside(Model model, HookeConstant hooke,
                                                            const Material& material, double spacing);

// `cells` even, at least 2.
[[nodiscard]] MeasuredBar measure_bar(Model model, HookeConstant hooke, const Material& material,
                                      double spacing, int cells);

}  // namespace flexel
