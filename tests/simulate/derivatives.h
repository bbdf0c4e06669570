// Forces and stiffness of a body against differences of its energy and forces.
#pragma once
#include <gtest/gtest.h>

#include "simulate/equilibrium/mechanics.h"

namespace flexel::simulate::testing {

// At `state`, for every `stride`th element, with steps of 1e-6 m: to 1e-6 of `young` times the spacing, and
// its square.
inline void expect_derivatives(Mechanics& mechanics, const State& state, double young, double spacing,
                               std::uint32_t stride) {
  const std::vector<Vec3> forces = mechanics.forces(state).total;
  mechanics.assemble(state);
  const BlockMatrix tangent = mechanics.stiffness();
  const double step = 1e-6;
  const auto elements = static_cast<std::uint32_t>(forces.size());
  for (std::uint32_t e = 0; e < elements; e += stride)
    for (int axis = 0; axis < 3; ++axis) {
      State more = state, less = state;
      more.displacement[e][axis] += step;
      less.displacement[e][axis] -= step;
      EXPECT_NEAR(forces[e][axis], -(mechanics.energy(more) - mechanics.energy(less)) / (2 * step),
                  1e-6 * young * spacing * spacing);
      const std::vector<Vec3> up = mechanics.forces(more).total, down = mechanics.forces(less).total;
      for (std::uint32_t row = 0; row < elements; ++row) {
        const Vec3 slope = -(up[row] - down[row]) / (2 * step);
        Vec3 column = Vec3::Zero();
        for (std::uint64_t q = tangent.row_offsets[row]; q < tangent.row_offsets[row + 1]; ++q)
          if (tangent.columns[q] == e) column = tangent.values[q].col(axis);
        EXPECT_LT((slope - column).norm(), 1e-6 * young * spacing) << row << " by " << e;
      }
    }
}

}  // namespace flexel::simulate::testing
