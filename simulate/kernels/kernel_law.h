// The laws but neo-Hooke's, eight cells at a time. Not inlined, so that neo-Hooke's loop stays as it is. Included
// by kernel_cells.h and kernel_product.cpp alone.
#pragma once
#include "simulate/kernels/kernel_state.h"
#include "simulate/laws/arruda_boyce.h"
#include "simulate/laws/mooney_rivlin.h"
#include "simulate/laws/orthotropic.h"

namespace flexel::simulate::step {
namespace {

using Matrix = laws::Matrix<Lanes>;
using Gradient = laws::Kinematics<Lanes>;

// First Piola-Kirchhoff stress [Pa]; what chains are short of their length, for laws that have them.
[[maybe_unused]] __attribute__((noinline)) void stress_of_law(const Law& law, const Gradient& g,
                                                              Matrix& stress, Lanes& reserve) {
  switch (law.name) {
    case LawName::neo_hooke:
    case LawName::mooney_rivlin:
      stress = laws::MooneyRivlin::stress(law, g);
      return;
    case LawName::arruda_boyce:
      stress = laws::ArrudaBoyce::stress(law, g);
      reserve = laws::ArrudaBoyce::reserve(law, g);
      return;
    case LawName::orthotropic:
      stress = laws::Orthotropic::stress(law, g);
      return;
  }
}

// J/m^3
[[maybe_unused]] __attribute__((noinline)) void energy_of_law(const Law& law, const Matrix& h,
                                                              Lanes& energy) {
  switch (law.name) {
    case LawName::neo_hooke:
    case LawName::mooney_rivlin:
      energy = laws::MooneyRivlin::energy(law, h);
      return;
    case LawName::arruda_boyce:
      energy = laws::ArrudaBoyce::energy(law, h);
      return;
    case LawName::orthotropic:
      energy = laws::Orthotropic::energy(law, h);
      return;
  }
}

// C : strain at rest [Pa], of an orthotropic law; `strain` symmetric.
[[maybe_unused]] __attribute__((noinline)) void stress_at_rest_of_law(const Law& law, const Matrix& strain,
                                                                      Matrix& stress) {
  stress = laws::Orthotropic::by_moduli(law, strain);
}

}  // namespace
}  // namespace flexel::simulate::step
