// The central springs of a body of models `springs` and `paper`, each pair of elements once: what LAMMPS
// calls bonds.
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/state/state.h"

namespace flexel::lammps {

// Pulls its ends together with stiffness (d - length), d their distance, and resists the rate of d by
// `damping`.
struct Spring {
  std::uint32_t a = 0, b = 0;  // elements
  double stiffness = 0;        // N/m
  double length = 0;           // m
  double damping = 0;          // N s/m
};

// Of all parts, in no particular order; `damping` (parts): tau [s] of each. What the cells around a
// connection of model `springs` hold of it is added up; where their rest lengths differ, the sum is one
// spring of the stiffness-weighted mean length, which pulls alike. Two elements that several pieces of matter
// connect may have several springs.
[[nodiscard]] std::vector<Spring> springs_of(const simulate::Problem& problem,
                                             const std::vector<double>& damping);

}  // namespace flexel::lammps
