// Neo-Hooke (simulate/laws/neo_hooke.h) for one cell, in H = F - I, so that strains of 1e-12 still have ten
// digits.
#pragma once
#include "simulate/laws/deformation.h"
#include "simulate/laws/law.h"

namespace flexel::simulate::neo_hooke {

// W [J/m^3], P [Pa], Cauchy's stress [Pa]. Need J > 0.
[[nodiscard]] double energy_density(const Law& law, const Mat3& h);
[[nodiscard]] Mat3 first_stress(const Law& law, const Mat3& h);
[[nodiscard]] Mat3 cauchy_stress(const Law& law, const Mat3& h);

// What dP/dF is made of: with w_a = F^-T gamma_a, dP gamma_a = mu (gamma_a . gamma_b) I
// + (mu - lambda ln J) w_b w_a^T + lambda w_a w_b^T.
struct Tangent {
  Mat3 inverse_transpose = Mat3::Identity();  // F^-T
  double log_volume = 0;                      // ln J
};
[[nodiscard]] Tangent tangent(const Mat3& h);
[[nodiscard]] Mat9 elasticity(const Law& law, const Tangent& tangent);

// `second` + dS/dE : sym(F^T change), S the second Piola-Kirchhoff stress.
[[nodiscard]] Mat3 predicted_stress(const Law& law, const Mat3& h, const Mat3& second, const Mat3& change);

// Plastic flow, which counts as stretch of the stiffness.
struct Flow {
  bool follows = false;  // the flow follows F, and is not known
  double metric = 0;     // largest eigenvalue of Cp^-1 of a rest shape; 0: none
  double volume = 1;     // Jp of the rest shape
};
// At least by how much the largest modulus exceeds that at rest.
[[nodiscard]] double stiffening(const Law& law, const Mat3& h, const Flow& flow = {});

}  // namespace flexel::simulate::neo_hooke
