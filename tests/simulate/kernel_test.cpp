// The kernel of timed runs against the models' own forces, cell by cell, and its laws: damping that no rigid
// motion feels, the same bits for any thread count and instruction set.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <random>

#include "formats/error.h"
#include "formats/parallel.h"
#include "simulate/cells.h"
#include "simulate/time/stability.h"
#include "simulate/time/stepper.h"
#include "tests/simulate/box_body.h"

namespace flexel {
namespace {

using testing::box_body;
using testing::BoxOptions;

const Material kGum{"gum", 12.1e5, 0.3, 580, "test"};

// Turned, partly filled, with holes: several chunks, rows of every length.
Body rough_body(const std::array<int, 3>& cells, const Vec3& spacing) {
  BoxOptions options;
  options.cells = cells;
  options.spacing = spacing;
  options.axes = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  options.fill = [](int i, int j, int k) {
    const int n = (i * 7 + j * 13 + k * 29) % 11;
    return n == 0 ? 0.0 : n < 4 ? 0.3 : 1.0;
  };
  return box_body(options);
}

State shaken(const Body& body, double amplitude, unsigned seed) {
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

Setting setting_of(const Body& body, Model model) {
  return {body, {kGum}, std::vector<std::uint8_t>(body.cell_count(), 0), {model}};
}

// The forces that the kernel used [N], out of one advance.
std::vector<Vec3> forces(const Setting& setting, const State& before, double tau, const std::string& isa = "",
                         bool book = false) {
  Stepper stepper(setting, {{tau}}, book, isa);
  State state = before;
  const double kick = 1e-3;
  (void)stepper.advance(state, {}, {kick, 0, false});
  std::vector<Vec3> result;
  for (std::size_t e = 0; e < state.velocity.size(); ++e)
    result.push_back((state.velocity[e] - before.velocity[e]) * stepper.mass()[e] / kick);
  return result;
}

std::vector<Vec3> brute_force(const Setting& setting, const State& state) {
  const Body& body = setting.body;
  const CellKind cells = cell_kind(body.parts[0].lattice, kGum);
  const SpringKind springs = spring_kind(body.parts[0].lattice, kGum);
  std::vector<Vec3> result(body.element_count(), Vec3::Zero());
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    CellVectors u;
    for (std::size_t a = 0; a < 8; ++a) u[a] = state.displacement[body.cell_elements[c][a]];
    const CellVectors f =
        setting.models[0] == Model::springs ? cell_forces(springs, u) : cell_forces(cells, u);
    for (std::size_t a = 0; a < 8; ++a) result[body.cell_elements[c][a]] += body.fill[c] * f[a];
  }
  return result;
}

double largest(const std::vector<Vec3>& values) {
  double result = 0;
  for (const Vec3& value : values) result = std::max(result, value.norm());
  return std::any_of(values.begin(), values.end(), [](const Vec3& value) { return !value.allFinite(); })
             ? std::numeric_limits<double>::infinity()
             : result;
}

double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double result = 0;
  for (std::size_t i = 0; i < a.size(); ++i) result = std::max(result, (a[i] - b[i]).norm());
  return result;
}

class KernelOf : public ::testing::TestWithParam<Model> {};

TEST_P(KernelOf, AgreesWithTheModelsCellByCell) {
  const Body body = rough_body({37, 19, 11}, Vec3::Constant(0.01));
  const Setting setting = setting_of(body, GetParam());
  for (const double amplitude : {1e-3, 1e-9}) {
    const State state = shaken(body, amplitude, 1);
    const std::vector<Vec3> expected = brute_force(setting, state);
    EXPECT_LT(largest_difference(forces(setting, state, 0), expected), 1e-11 * largest(expected));
  }
}

TEST_P(KernelOf, DampingFeelsNoRigidMotion) {
  const Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01));
  const Setting setting = setting_of(body, GetParam());
  State state = shaken(body, 1e-3, 2);  // strained
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.velocity[e] = Vec3(1, 2, 3) + Vec3(4, -5, 6).cross(body.rest[e] + state.displacement[e]);
  const std::vector<Vec3> elastic = forces(setting, state, 0);
  EXPECT_LT(largest_difference(forces(setting, state, 1e-2), elastic), 1e-10 * largest(elastic));
}

TEST_P(KernelOf, DampingKeepsMomentaAndTakesEnergy) {
  const Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01));
  const Setting setting = setting_of(body, GetParam());
  const State state = shaken(body, 1e-3, 3);
  const std::vector<Vec3> elastic = forces(setting, state, 0), all = forces(setting, state, 1e-3);
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  double power = 0, size = 0;
  for (std::size_t e = 0; e < all.size(); ++e) {
    const Vec3 damping = all[e] - elastic[e];
    force += damping;
    torque += (body.rest[e] + state.displacement[e]).cross(damping);
    power += damping.dot(state.velocity[e]);
    size += damping.norm();
  }
  EXPECT_LT(force.norm(), 1e-11 * size);
  EXPECT_LT(torque.norm(), 1e-11 * size * 0.1);
  EXPECT_LT(power, 0);
}

TEST_P(KernelOf, DampingIsTheRateOfTheForcesAtRest) {
  // near rest, damping with tau is tau times the rate of the elastic forces
  const Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01));
  const Setting setting = setting_of(body, GetParam());
  State state = shaken(body, 0, 4);
  const double tau = 1e-3, dt = 1e-9;
  const std::vector<Vec3> damped = forces(setting, state, tau);
  State ahead = state;
  for (std::size_t e = 0; e < body.element_count(); ++e) ahead.displacement[e] = dt * state.velocity[e];
  std::vector<Vec3> rate = brute_force(setting, ahead);
  for (Vec3& f : rate) f *= tau / dt;
  EXPECT_LT(largest_difference(damped, rate), 1e-5 * largest(rate));
}

TEST_P(KernelOf, SameBitsForAnyThreadsAndInstructions) {
  const Body body = rough_body({37, 19, 11}, Vec3::Constant(0.01));
  const Setting setting = setting_of(body, GetParam());
  const double tau = 1e-5, dt = 0.5 * stable_step(setting, {tau});
  const auto after = [&](const std::string& isa, int threads, bool book) {
    const ThreadLimit limit(threads);
    Stepper stepper(setting, {{tau}}, book, isa);
    State state = shaken(body, 1e-4, 5);
    for (int i = 0; i < 5; ++i) (void)stepper.advance(state, {}, {dt, dt, false});
    return state;
  };
  const State reference = after("portable", 1, false);
  for (const auto& [isa, threads, book] :
       {std::tuple{"portable", 2, false}, {"portable", 7, true}, {"", 2, false}, {"avx2", 2, false}}) {
    State other;
    try {
      other = after(isa, threads, book);
    } catch (const InputError&) {
      continue;  // a machine without that instruction set
    }
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      ASSERT_EQ(other.displacement[e], reference.displacement[e]) << isa << threads;
      ASSERT_EQ(other.velocity[e], reference.velocity[e]) << isa << threads;
    }
  }
}

// Stable a little below the bound, not above it.
TEST_P(KernelOf, BoundIsSafeAndNotWasteful) {
  const Body body = [&] {
    BoxOptions options;
    options.cells = {8, 8, 8};
    options.spacing = Vec3::Constant(0.01);
    return box_body(options);
  }();
  const Setting setting = setting_of(body, GetParam());
  const double omega = std::sqrt(cell_frequencies(setting)[0]);
  for (const double zeta : {0.0, 0.2, 1.0, 5.0}) {
    const double tau = 2 * zeta / omega, bound = stable_step(setting, {tau});
    const auto growth = [&](double dt) {
      Stepper stepper(setting, {{tau}}, false);
      State state = shaken(body, 0, 6);
      for (Vec3& v : state.velocity) v *= 1e-9;
      for (int i = 0; i < 400; ++i) (void)stepper.advance(state, {}, {dt, dt, false});
      return largest(state.velocity) / 1e-9;
    };
    EXPECT_LT(growth(0.99 * bound), 100) << zeta;
    EXPECT_GT(growth(2.5 * bound), 1e6) << zeta;
  }
}

std::string name_of(const ::testing::TestParamInfo<Model>& info) {
  return info.param == Model::cells ? "cells" : "springs";
}
INSTANTIATE_TEST_SUITE_P(Models, KernelOf, ::testing::Values(Model::cells, Model::springs), name_of);

TEST(Kernel, FoldedCellIsTold) {
  const Body body = box_body({{2, 2, 2}, Vec3::Constant(0.01)});
  const Setting setting = setting_of(body, Model::cells);
  State state = shaken(body, 0, 7);
  state.displacement[13] = Vec3(0.05, 0.05, 0.05);
  Stepper stepper(setting, {{0}}, false);
  EXPECT_LE(stepper.advance(state, {}, {1e-6, 1e-6, false}).smallest_jacobian, 0);
  state.displacement[13].x() = std::nan("");
  EXPECT_LE(stepper.advance(state, {}, {1e-6, 1e-6, false}).smallest_jacobian, 0);
}

TEST(Kernel, UnknownInstructionSetIsRefused) {
  EXPECT_THROW((void)kernel_table("sse9"), InputError);
}

// With unequal spacings too: only model cells takes those.
TEST(Kernel, UnevenSpacing) {
  const Body body = rough_body({9, 7, 5}, Vec3(0.01, 0.013, 0.008));
  const Setting setting = setting_of(body, Model::cells);
  const State state = shaken(body, 8e-4, 8);
  const std::vector<Vec3> expected = brute_force(setting, state);
  EXPECT_LT(largest_difference(forces(setting, state, 0), expected), 1e-11 * largest(expected));
}

}  // namespace
}  // namespace flexel
