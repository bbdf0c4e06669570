// For tests that drive the stepper by hand: states, forces, prescribed positions.
#pragma once
#include <cmath>
#include <random>

#include "simulate/time/stability.h"
#include "simulate/time/stepper.h"
#include "tests/simulate/box_body.h"

namespace flexel::testing {

inline Setting setting_of(const Body& body, const Material& material, Model model = Model::cells) {
  return {body, std::vector<Material>(body.parts.size(), material),
          std::vector<std::uint8_t>(body.cell_count(), 0), std::vector<Model>(body.parts.size(), model)};
}

inline State at_rest(const Body& body) {
  State state;
  state.displacement.assign(body.element_count(), Vec3::Zero());
  state.velocity.assign(body.element_count(), Vec3::Zero());
  return state;
}

// Forces of the cells [N] at `state`, which flow and break on as in a step.
inline std::vector<Vec3> forces_of(Stepper& stepper, const State& state) {
  State copy = state;
  for (Vec3& v : copy.velocity) v.setZero();
  stepper.advance(copy, {}, {1, 0, false});
  for (std::size_t e = 0; e < copy.velocity.size(); ++e) copy.velocity[e] *= stepper.mass()[e];
  return copy.velocity;
}

// Displacements of up to `size` in every direction.
inline std::vector<Vec3> random_displacements(const Body& body, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Vec3> u(body.element_count());
  for (Vec3& value : u)
    for (double& x : value) x = size * (2.0 * static_cast<double>(generator()) / 4294967295.0 - 1);
  return u;
}

}  // namespace flexel::testing
