// The laws but neo-Hooke's, eight cells at a time. Not inlined, so that neo-Hooke's loop stays as it is. Included
// by kernel_cells.h and kernel_product.cpp alone.
#pragma once
#include "simulate/kernels/kernel_state.h"
#include "simulate/laws/mooney_rivlin.h"
#include "simulate/laws/orthotropic.h"

namespace flexel::simulate::step {
namespace {

using Matrix = laws::Matrix<Lanes>;
using Gradient = laws::Kinematics<Lanes>;

// First Piola-Kirchhoff stress [Pa].
[[maybe_unused]] __attribute__((noinline)) void stress_of_law(const Law& law, const Gradient& g,
                                                              Matrix& stress) {
  stress = law.name == LawName::mooney_rivlin ? laws::MooneyRivlin::stress(law, g)
                                              : laws::Orthotropic::stress(law, g);
}

// J/m^3
[[maybe_unused]] __attribute__((noinline)) void energy_of_law(const Law& law, const Matrix& h,
                                                              Lanes& energy) {
  energy = law.name == LawName::mooney_rivlin ? laws::MooneyRivlin::energy(law, h)
                                              : laws::Orthotropic::energy(law, h);
}

// C : strain at rest [Pa], of an orthotropic law; `strain` symmetric.
[[maybe_unused]] __attribute__((noinline)) void stress_at_rest_of_law(const Law& law, const Matrix& strain,
                                                                      Matrix& stress) {
  stress = laws::Orthotropic::by_moduli(law, strain);
}

}  // namespace
}  // namespace flexel::simulate::step
