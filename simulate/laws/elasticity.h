// The seam of the elastic laws: what every user of a material asks of its law, one cell at a time, in
// H = F - I. Timed runs have the same laws eight cells at a time (simulate/kernels/kernel_law.h).
#pragma once
#include "base/math/vec.h"
#include "simulate/laws/deformation.h"
#include "simulate/laws/law.h"

namespace flexel::simulate {

// W [J/m^3], P = dW/dF (first Piola-Kirchhoff) and Cauchy's stress [Pa], dP/dF [Pa]. Need J > 0.
[[nodiscard]] double energy_density(const Law& law, const Mat3& gradient);
[[nodiscard]] Mat3 first_stress(const Law& law, const Mat3& gradient);
[[nodiscard]] Mat3 cauchy_stress(const Law& law, const Mat3& gradient);
[[nodiscard]] Mat9 elasticity(const Law& law, const Mat3& gradient);

// A bound on the speed of waves: the largest eigenvalue of dP/dF over that at rest. Neo-Hooke: see
// neo_hooke::stiffening. Infinity for J <= 0.
[[nodiscard]] double stiffening(const Law& law, const Mat3& gradient);

// What the law's chains are short of their length: 1 - q (arruda_boyce.h). Where it is not above 0 there is no equilibrium,
// energy and stiffening() are infinite. 1 for laws without chains.
[[nodiscard]] double chain_reserve(const Law& law, const Mat3& gradient);

// dS/dE at rest (C of small strains), of any law.
[[nodiscard]] Mat6 moduli_at_rest(const Law& law);

[[nodiscard]] Law neo_hooke_law(double mu, double lambda);
// C10 + C01 > 0, bulk > 0.
[[nodiscard]] Law mooney_rivlin_law(double c10, double c01, double bulk);
// mu > 0, lambda_m > 1, bulk > 0.
[[nodiscard]] Law arruda_boyce_law(double mu, double lambda_m, double bulk);
// `compliance` in the material's axes [1/Pa], positive definite; `axes`: from those to the frame of F.
[[nodiscard]] Law orthotropic_law(const Mat6& compliance, const Mat3& axes);

}  // namespace flexel::simulate
