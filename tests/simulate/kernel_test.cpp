// The kernel of timed runs against the models' own forces, cell by cell, and its laws: damping that no rigid
// motion feels, the same bits for any thread count and instruction set.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <random>

#include "simulate/models/cells.h"
#include "tests/simulate/law_materials.h"
#include "tests/simulate/numbered_body.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using testing::forces_in_step;
using testing::largest;
using testing::largest_difference;
using testing::shaken;

const Material kKernelGum{"gum", 12.1e5, 0.3, 580, "test"};

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

struct KernelCase {
  const char* name;
  Model model;
  Material material;
};

Problem kernel_setting(const Body& body, const KernelCase& of) {
  return testing::problem_of(body, of.material, of.model);
}
Problem kernel_setting(const Body& body, Model model) {
  return testing::problem_of(body, kKernelGum, model);
}

std::vector<Vec3> cell_by_cell(const Problem& problem, const State& state) {
  const Body& body = problem.body;
  const CellKind cells = cell_kind(body.parts[0].lattice, problem.materials[0]);
  const SpringKind springs = spring_kind(body.parts[0].lattice, problem.materials[0]);
  std::vector<Vec3> result(body.element_count(), Vec3::Zero());
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    CellVectors u;
    for (std::size_t a = 0; a < 8; ++a) u[a] = state.displacement[body.cell_elements[c][a]];
    const CellVectors f =
        problem.models[0] == Model::springs ? cell_forces(springs, u) : cell_forces(cells, u);
    for (std::size_t a = 0; a < 8; ++a) result[body.cell_elements[c][a]] += body.fill[c] * f[a];
  }
  return result;
}

class KernelOf : public ::testing::TestWithParam<KernelCase> {};

TEST_P(KernelOf, AgreesWithTheModelsCellByCell) {
  const Body body = rough_body({37, 19, 11}, Vec3::Constant(0.01));
  const Problem problem = kernel_setting(body, GetParam());
  for (const double amplitude : {1e-3, 1e-9}) {
    const State state = shaken(body, amplitude, 1);
    const std::vector<Vec3> expected = cell_by_cell(problem, state);
    EXPECT_LT(largest_difference(forces_in_step(problem, state, 0), expected), 1e-11 * largest(expected));
  }
}

TEST_P(KernelOf, AgreesHoweverTheElementsAreNumbered) {
  const Body rough = rough_body({19, 11, 7}, Vec3::Constant(0.01));
  std::vector<std::uint32_t> to(rough.element_count());
  std::iota(to.begin(), to.end(), 0u);
  std::shuffle(to.begin(), to.end(), std::mt19937(6));
  for (const Body& body : {testing::renumbered(rough, to), testing::cells_beside_gaps(24, 0.01)}) {
    const Problem problem = kernel_setting(body, GetParam());
    const State state = shaken(body, 1e-3, 1);
    const std::vector<Vec3> expected = cell_by_cell(problem, state);
    EXPECT_LT(largest_difference(forces_in_step(problem, state, 0), expected), 1e-11 * largest(expected));
  }
}

TEST_P(KernelOf, DampingFeelsNoRigidMotion) {
  const Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01));
  const Problem problem = kernel_setting(body, GetParam());
  State state = shaken(body, 1e-3, 2);  // strained
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.velocity[e] = Vec3(1, 2, 3) + Vec3(4, -5, 6).cross(body.rest[e] + state.displacement[e]);
  const std::vector<Vec3> elastic = forces_in_step(problem, state, 0);
  EXPECT_LT(largest_difference(forces_in_step(problem, state, 1e-2), elastic), 1e-10 * largest(elastic));
}

TEST_P(KernelOf, ForcesKeepMomentaAndDampingTakesEnergy) {
  const Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01));
  testing::expect_inner_forces(kernel_setting(body, GetParam()), shaken(body, 1e-3, 3), 1e-3);
}

TEST_P(KernelOf, DampingIsTheRateOfTheForcesAtRest) {
  // near rest, damping with tau is tau times the rate of the elastic forces
  const Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01));
  const Problem problem = kernel_setting(body, GetParam());
  State state = shaken(body, 0, 4);
  const double tau = 1e-3, dt = 1e-9;
  const std::vector<Vec3> damped = forces_in_step(problem, state, tau);
  State ahead = state;
  for (std::size_t e = 0; e < body.element_count(); ++e) ahead.displacement[e] = dt * state.velocity[e];
  std::vector<Vec3> rate = cell_by_cell(problem, ahead);
  for (Vec3& f : rate) f *= tau / dt;
  EXPECT_LT(largest_difference(damped, rate), 1e-5 * largest(rate));
}

TEST_P(KernelOf, SameBitsForAnyThreadsInstructionsAndBooks) {
  const Body body = rough_body({37, 19, 11}, Vec3::Constant(0.01));
  testing::expect_same_bits(kernel_setting(body, GetParam()));
}

// Stable a little below the bound, not above it.
TEST_P(KernelOf, BoundIsSafeAndNotWasteful) {
  const Body body = [&] {
    BoxOptions options;
    options.cells = {8, 8, 8};
    options.spacing = Vec3::Constant(0.01);
    return box_body(options);
  }();
  const Problem problem = kernel_setting(body, GetParam());
  const double omega = std::sqrt(cell_frequencies(problem)[0]);
  for (const double zeta : {0.0, 0.2, 1.0, 5.0}) {
    const double tau = 2 * zeta / omega, bound = stable_step(problem, {tau});
    const auto growth = [&](double dt) {
      Stepper stepper(problem, {{tau}}, false);
      State state = shaken(body, 0, 6);
      for (Vec3& v : state.velocity) v *= 1e-9;
      for (int i = 0; i < 400; ++i) (void)stepper.advance(state, {}, {dt, dt, false});
      return largest(state.velocity) / 1e-9;
    };
    EXPECT_LT(growth(0.99 * bound), 100) << zeta;
    EXPECT_GT(growth(2.5 * bound), 1e6) << zeta;
  }
}

// What keeps its volume is damped by the shear modulus alone, however far it is drawn.
TEST(KernelDamping, HasNoBulkModulusAtConstantVolume) {
  const Body body = rough_body({5, 4, 3}, Vec3::Constant(0.01));
  const Mat3 drawn = Vec3(1.5, 1 / std::sqrt(1.5), 1 / std::sqrt(1.5)).asDiagonal();
  Mat3 rate;  // without a trace
  rate << 2, 0.5, -0.3, 0.7, -1.5, 0.2, 0.1, -0.4, -0.5;
  std::vector<std::vector<Vec3>> found;
  for (const double poisson : {0.3, 0.4999}) {
    Material material{"gum", 2e6 * (1 + poisson), poisson, 1000, "test"};
    const Problem problem = testing::problem_of(body, material, Model::cells);
    State state = shaken(body, 0, 1);
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      state.displacement[e] = drawn * body.rest[e] - body.rest[e];
      state.velocity[e] = rate * drawn * body.rest[e];
    }
    found.push_back(forces_in_step(problem, state, 1e-2));
    const std::vector<Vec3> elastic = forces_in_step(problem, state, 0);
    for (std::size_t e = 0; e < elastic.size(); ++e) found.back()[e] -= elastic[e];
  }
  EXPECT_LT(largest_difference(found[0], found[1]), 1e-8 * largest(found[0]));
}

// Of some cells thrice as long: as if they damped twice once more by themselves, the others broken.
TEST_P(KernelOf, DampingOfEditedCells) {
  Body body = rough_body({9, 7, 5}, Vec3::Constant(0.01)), others = body;
  const Problem problem = kernel_setting(body, GetParam()), edited = kernel_setting(others, GetParam());
  const State state = shaken(body, 1e-3, 9);
  const double tau = 1e-3;
  std::vector<Vec3> expected = forces_in_step(problem, state, tau);
  Column change{1, std::vector<double>(body.cell_count(), 0)};
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    change.values[c] = c % 3 == 1 ? 2 : 0;
    others.broken[c] = c % 3 != 1;
  }
  const std::vector<Vec3> all = forces_in_step(edited, state, tau),
                          elastic = forces_in_step(edited, state, 0);
  for (std::size_t e = 0; e < expected.size(); ++e) expected[e] += 2 * (all[e] - elastic[e]);
  body.cell_columns["damping_change"] = change;
  const std::vector<Vec3> found = forces_in_step(problem, state, tau);
  EXPECT_LT(largest_difference(found, expected), 1e-11 * largest(expected));
  EXPECT_GT(largest_difference(found, forces_in_step(problem, state, 0)), 1e-3 * largest(expected));
}

std::string name_of(const ::testing::TestParamInfo<KernelCase>& tested) {
  return tested.param.name;
}
INSTANTIATE_TEST_SUITE_P(
    Models, KernelOf,
    ::testing::Values(KernelCase{"cells", Model::cells, kKernelGum},
                      KernelCase{"springs", Model::springs, kKernelGum},
                      KernelCase{"mooney_rivlin", Model::cells, testing::mooney_rivlin_material()},
                      KernelCase{"arruda_boyce", Model::cells, testing::arruda_boyce_material()},
                      KernelCase{"orthotropic", Model::cells, testing::orthotropic_material()}),
    name_of);

// Cells without fill may be drawn as far as they like.
TEST(Kernel, ChainsBeyondTheirLengthAreTold) {
  Body body = box_body({{9, 1, 1}, Vec3::Constant(0.01)});
  const Problem problem = testing::problem_of(body, testing::arruda_boyce_material(), Model::cells);
  for (const bool filled : {true, false})
    for (const double stretch : {3.0, 3.5}) {  // they end at 3.37
      body.fill.assign(body.cell_count(), filled ? 1 : 0);
      State state = testing::at_rest(body);
      for (std::size_t e = 0; e < body.element_count(); ++e)
        state.displacement[e] = body.rest[e].cwiseProduct(
            Vec3(stretch, 1 / std::sqrt(stretch), 1 / std::sqrt(stretch)) - Vec3::Ones());
      Stepper stepper(problem, {{0}}, false);
      const double reached = stepper.advance(state, {}, {1e-9, 1e-9, false}).smallest_jacobian;
      EXPECT_EQ(reached > 0, !filled || stretch < 3.37) << stretch << filled;
      for (const Vec3& velocity : state.velocity) EXPECT_TRUE(velocity.allFinite());
    }
}

TEST(Kernel, FoldedCellIsTold) {
  const Body body = box_body({{2, 2, 2}, Vec3::Constant(0.01)});
  const Problem problem = kernel_setting(body, Model::cells);
  State state = shaken(body, 0, 7);
  state.displacement[13] = Vec3(0.05, 0.05, 0.05);
  Stepper stepper(problem, {{0}}, false);
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
  const Problem problem = kernel_setting(body, Model::cells);
  const State state = shaken(body, 8e-4, 8);
  const std::vector<Vec3> expected = cell_by_cell(problem, state);
  EXPECT_LT(largest_difference(forces_in_step(problem, state, 0), expected), 1e-11 * largest(expected));
}

}  // namespace
}  // namespace flexel::simulate
