// How parameters of tests are printed, which are part of their names.
#pragma once
#include <array>
#include <cstddef>
#include <ostream>

#include "simulate/indent/indenter_shape.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

inline void PrintTo(Model model, std::ostream* out) {
  *out << std::array{"cells", "springs", "paper", "quadratic"}[static_cast<std::size_t>(model)];
}

inline void PrintTo(HookeConstant hooke, std::ostream* out) {
  *out << std::array{"paper", "ganovelli", "isotropic"}[static_cast<std::size_t>(hooke)];
}

inline void PrintTo(const IndenterShape& shape, std::ostream* out) {
  *out << (shape.plate ? "plate" : "ball") << " of " << shape.radius << ", rounding " << shape.rounding;
}

}  // namespace flexel::simulate
