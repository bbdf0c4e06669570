// For tests of timed runs and of the stepper, which they drive by hand: bodies, states, forces, refusals.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <tuple>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/models/stability.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "simulate/stepping/stepper.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate::testing {

inline Body box_of(std::array<int, 3> cells, double spacing = 1e-3) {
  BoxOptions options;
  options.cells = cells;
  options.spacing = Vec3::Constant(spacing);
  return box_body(options);
}

// What is said of a scene for a box of two cells that is refused.
inline std::string refusal(const std::string& scene) {
  Body body = box_of({2, 1, 1});
  Progress progress("test", Progress::Mode::quiet);
  try {
    (void)simulate(body, parse_scene(scene, "s.toml"), {}, progress);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

inline const Material kCauchyGum{"gum", 1e6, 0.25, 1000, "test"};  // Poisson's ratio of springs

inline Problem problem_of(const Body& body, const Material& material, Model model = Model::cells) {
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

// Displacements of up to `amplitude` [m] and velocities of up to 1 m/s in every direction.
inline State shaken(const Body& body, double amplitude, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&] { return Vec3(any(random), any(random), any(random)); };
  State state;
  state.time = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    state.displacement.push_back(amplitude * vector());
    state.velocity.push_back(vector());
  }
  return state;
}

// The forces that the kernel used [N], damping with time `tau` among them, out of one advance.
inline std::vector<Vec3> forces_in_step(const Problem& problem, const State& before, double tau,
                                        bool book = false) {
  Stepper stepper(problem, {{tau}}, book);
  State state = before;
  const double kick = 1e-3;
  EXPECT_GT(stepper.advance(state, {}, {kick, 0, false}).smallest_jacobian, 0);
  std::vector<Vec3> result;
  for (std::size_t e = 0; e < state.velocity.size(); ++e)
    result.push_back((state.velocity[e] - before.velocity[e]) * stepper.mass()[e] / kick);
  return result;
}

// Infinity where a component is not finite.
inline double largest(const std::vector<Vec3>& values) {
  double result = 0;
  for (const Vec3& value : values)
    result = value.allFinite() ? std::max(result, value.norm()) : std::numeric_limits<double>::infinity();
  return result;
}

inline double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  std::vector<Vec3> difference = a;
  for (std::size_t i = 0; i < a.size(); ++i) difference[i] -= b[i];
  return largest(difference);
}

// Forces along the distance of the elements that they act between: neither momentum changes, and damping
// takes energy.
inline void expect_inner_forces(const Problem& problem, const State& state, double tau) {
  const std::vector<Vec3> elastic = forces_in_step(problem, state, 0),
                          all = forces_in_step(problem, state, tau);
  for (const bool damping : {false, true}) {
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    double power = 0, size = 0, arm = 0;
    for (std::size_t e = 0; e < all.size(); ++e) {
      const Vec3 each = damping ? Vec3(all[e] - elastic[e]) : elastic[e];
      const Vec3 at = problem.body.rest[e] + state.displacement[e];
      force += each;
      torque += at.cross(each);
      power += each.dot(state.velocity[e]);
      size += each.norm();
      arm = std::max(arm, at.norm());
    }
    EXPECT_LT(force.norm(), 1e-11 * size);
    EXPECT_LT(torque.norm(), 1e-11 * size * arm);
    if (damping) {
      EXPECT_LT(power, 0);
    }
  }
}

// Five steps from a shaken state end in the same bits whatever the threads, the instruction set and the
// books.
inline void expect_same_bits(const Problem& problem) {
  const double tau = 1e-5, dt = 0.5 * stable_step(problem, {tau});
  const auto after = [&](const std::string& isa, int threads, bool book) {
    const ThreadLimit limit(threads);
    Stepper stepper(problem, {{tau}}, book, isa);
    State state = shaken(problem.body, 1e-4, 5);
    for (int i = 0; i < 5; ++i) (void)stepper.advance(state, {}, {dt, dt, false});
    return state;
  };
  const State reference = after("portable", 1, false);
  for (const auto& [isa, threads, book] : {std::tuple{"portable", 2, true},
                                           {"portable", 7, false},
                                           {"avx2", 1, false},
                                           {"avx2", 7, true},
                                           {"avx512", 1, true},
                                           {"avx512", 2, false}}) {
    State other;
    try {
      other = after(isa, threads, book);
    } catch (const InputError&) {
      continue;  // a machine without that instruction set
    }
    EXPECT_EQ(other.displacement, reference.displacement) << isa << threads;
    EXPECT_EQ(other.velocity, reference.velocity) << isa << threads;
  }
}

// Displacements of up to `size` in every direction.
inline std::vector<Vec3> random_displacements(const Body& body, double size, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Vec3> u(body.element_count());
  for (Vec3& value : u)
    for (double& x : value) x = size * (2.0 * static_cast<double>(generator()) / 4294967295.0 - 1);
  return u;
}

}  // namespace flexel::simulate::testing
