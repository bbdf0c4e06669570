// Springs computed connection by connection: every connection of every cell once, whatever the shape, with
// the forces, momenta and energies of the model cell by cell.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <random>
#include <tuple>

#include "simulate/kernels/connection_runs.h"
#include "simulate/models/cells.h"
#include "simulate/stepping/step_bound.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/study_beam.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using testing::forces_in_step;
using testing::kStudyGum;
using testing::largest;
using testing::largest_difference;
using testing::shaken;

// A share of the voxels, each with a fill of its own; turned.
Body crumbs(const std::array<int, 3>& cells, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0, 1);
  std::map<std::array<int, 3>, double> fills;
  BoxOptions options;
  options.cells = cells;
  options.spacing = Vec3::Constant(0.01);
  options.axes = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  options.fill = [&](int i, int j, int k) {
    const auto [found, is_new] = fills.try_emplace({i, j, k}, 0);
    if (is_new) found->second = any(random) < share ? 0.05 + 0.95 * any(random) : 0;
    return found->second;
  };
  return box_body(options);
}

// A shell two cells thick about a ball: rows of every length, oblique.
Body shell(int n) {
  BoxOptions options;
  options.cells = {n, n, n};
  options.spacing = Vec3::Constant(0.01);
  options.fill = [n](int i, int j, int k) {
    const double r = (Vec3(i, j, k) - Vec3::Constant(0.5 * (n - 1))).norm();
    return r < 0.5 * n && r > 0.5 * n - 2 ? 0.2 + 0.8 * std::abs(std::sin(r * 7 + i)) : 0.0;
  };
  return box_body(options);
}

// Two leaves of cells on one: their lowest corners are the same elements.
Body branching() {
  Body body = box_body({{3, 3, 4}, Vec3::Constant(0.01)});
  const std::uint32_t top = body.parts[0].element_end - 32;  // the two upper planes, once more
  for (std::uint32_t e = top; e < top + 32; ++e) {
    body.lattice_index.push_back(body.lattice_index[e]);
    body.piece.push_back(1);
    body.rest.push_back(body.rest[e]);
  }
  body.position = body.rest;
  const std::size_t cells = body.cell_count();
  for (std::size_t c = cells - 18; c < cells; ++c) {
    std::array<std::uint32_t, 8> corners = body.cell_elements[c];
    for (std::uint32_t& e : corners)
      if (e >= top) e += 32;
    body.cell_elements.push_back(corners);
    body.fill.push_back(0.5);
    body.broken.push_back(0);
  }
  body.parts[0].element_end = static_cast<std::uint32_t>(body.element_count());
  body.parts[0].cell_end = static_cast<std::uint32_t>(body.cell_count());
  return body;
}

Problem springs_setting(const Body& body, std::vector<Model> models = {Model::springs}) {
  return {body, std::vector<Material>(body.parts.size(), kStudyGum),
          std::vector<std::uint8_t>(body.cell_count(), 0), std::move(models)};
}

// [N] (elements), spring by spring, cell by cell; of elasticity and damping.
std::vector<Vec3> spring_by_spring(const Problem& problem, const State& state, double tau) {
  const Body& body = problem.body;
  const SpringKind kind = spring_kind(body.parts[0].lattice, kStudyGum);
  std::vector<Vec3> result(body.element_count(), Vec3::Zero());
  for (std::size_t c = 0; c < body.cell_count(); ++c)
    for (const Spring& spring : kind.springs) {
      const std::uint32_t a = body.cell_elements[c][spring.a], b = body.cell_elements[c][spring.b];
      const Vec3 d = spring.rest + state.displacement[b] - state.displacement[a];
      const double rate = (state.velocity[b] - state.velocity[a]).dot(d.normalized());
      const Vec3 force =
          body.fill[c] * spring.stiffness * (d.norm() - spring.rest.norm() + tau * rate) * d.normalized();
      result[a] += force;
      result[b] -= force;
    }
  return result;
}

std::vector<std::pair<const char*, Body>> bodies() {
  return {{"one cell", box_body({{1, 1, 1}, Vec3::Constant(0.01)})},
          {"plate", box_body({{70, 9, 1}, Vec3::Constant(0.01)})},
          {"wall across x", box_body({{1, 9, 70}, Vec3::Constant(0.01)})},
          {"half of the voxels", crumbs({23, 11, 20}, 0.5, 1)},
          {"nearly all", crumbs({30, 19, 20}, 0.95, 2)},
          {"few", crumbs({40, 20, 18}, 0.08, 3)},
          {"shell", shell(21)},
          {"branching", branching()}};
}

TEST(ConnectionKernel, ForcesAreThoseOfTheSpringsOfAllCells) {
  for (const auto& [name, body] : bodies()) {
    const Problem problem = springs_setting(body);
    const State state = shaken(body, 1e-3, 1);
    for (const double tau : {0.0, 1e-3}) {
      const std::vector<Vec3> expected = spring_by_spring(problem, state, tau);
      const std::vector<Vec3> found = forces_in_step(problem, state, tau);
      EXPECT_LT(largest_difference(found, expected), 1e-11 * largest(expected)) << name << tau;
      EXPECT_EQ(forces_in_step(problem, state, tau, true), found) << name << tau;
    }
  }
}

TEST(ConnectionKernel, BodiesOfThisTestHaveSeveralChunks) {
  const Body many = crumbs({30, 19, 20}, 0.95, 2), leaves = branching();
  const Problem of_many = springs_setting(many), of_leaves = springs_setting(leaves);
  EXPECT_GT(step_layout(of_many, {{0}}).chunks.size(), 2u);
  EXPECT_TRUE(step_layout(of_many, {{0}}).blocks.empty());
  EXPECT_EQ(step_layout(of_leaves, {{0}}).chunks.size(), 2u);  // one of the leaves by itself
}

TEST(ConnectionKernel, KeepsMomentaAndDampingTakesEnergy) {
  const Body body = crumbs({23, 11, 20}, 0.5, 4);
  testing::expect_inner_forces(springs_setting(body), shaken(body, 2e-3, 2), 1e-3);
}

// Every connection of the cells once, with the fills of all cells around it.
TEST(ConnectionKernel, RunsHoldEveryConnectionOnce) {
  for (const auto& [name, body] : bodies()) {
    if (std::string(name) == "branching") continue;  // its two leaves are two chunks
    std::vector<std::array<std::uint16_t, 8>> cells;
    using Key = std::tuple<std::size_t, std::size_t, std::size_t>;  // direction, ends
    std::map<Key, double> expected, found;
    for (std::size_t c = 0; c < body.cell_count(); ++c) {
      std::array<std::uint16_t, 8> corners;
      for (std::size_t a = 0; a < 8; ++a) corners[a] = static_cast<std::uint16_t>(body.cell_elements[c][a]);
      cells.push_back(corners);
      for (const std::uint32_t a : body.cell_elements[c])
        for (const std::uint32_t b : body.cell_elements[c])
          for (std::size_t d = 0; d < half_neighbourhood.size(); ++d) {
            bool leads = true;
            for (std::size_t j = 0; j < 3; ++j)
              leads =
                  leads && body.lattice_index[b][j] - body.lattice_index[a][j] == half_neighbourhood[d][j];
            if (leads) expected[{d, a, b}] += body.fill[c];
          }
    }
    const ConnectionRuns made = connection_runs(cells, body.fill, body.element_count());
    for (const step::ConnectionRun& run : made.runs) {
      const int around = 4 >> (std::abs(half_neighbourhood[run.direction][0]) +
                               std::abs(half_neighbourhood[run.direction][1]) +
                               std::abs(half_neighbourhood[run.direction][2]) - 1);
      for (std::size_t i = 0; i < step::kLanes * run.blocks; ++i) {
        double fill = 0;
        for (int n = 0; n < around; ++n) {
          ASSERT_LT(run.cell[n] + i, made.fill.size());
          fill += made.fill[run.cell[n] + i];
        }
        ASSERT_TRUE(run.blocks == 1 || run.lanes == 0xff);
        if (fill == 0 || !(run.lanes >> i % step::kLanes & 1)) continue;
        const auto [at, is_new] =
            found.try_emplace({run.direction, run.a + i - step::kLanes, run.b + i - step::kLanes}, fill);
        EXPECT_TRUE(is_new) << name;
      }
    }
    ASSERT_EQ(found.size(), expected.size()) << name;
    for (const auto& [key, fill] : expected) ASSERT_NEAR(found[key], fill, 1e-14) << name;
  }
}

TEST(ConnectionKernel, SameBitsForAnyThreadsInstructionsAndBooks) {
  const Body body = crumbs({30, 19, 20}, 0.8, 5);
  testing::expect_same_bits(springs_setting(body));
}

// Where another part breaks, the stepper tells the energy of all: also of those computed by connection.
TEST(ConnectionKernel, TellsItsEnergyWhereAnotherPartBreaks) {
  Body body = crumbs({9, 8, 7}, 0.7, 7);
  const Body other = box_body({{3, 3, 3}, Vec3::Constant(0.01)});
  Part part = other.parts[0];
  const auto elements = static_cast<std::uint32_t>(body.element_count());
  const auto cells = static_cast<std::uint32_t>(body.cell_count());
  for (std::size_t e = 0; e < other.element_count(); ++e) {
    body.lattice_index.push_back(other.lattice_index[e]);
    body.piece.push_back(0);
    body.rest.push_back(other.rest[e]);
  }
  body.position = body.rest;
  for (std::size_t c = 0; c < other.cell_count(); ++c) {
    std::array<std::uint32_t, 8> corners = other.cell_elements[c];
    for (std::uint32_t& e : corners) e += elements;
    body.cell_elements.push_back(corners);
    body.fill.push_back(1);
    body.broken.push_back(0);
  }
  part.element_begin = elements;
  part.element_end = static_cast<std::uint32_t>(body.element_count());
  part.cell_begin = cells;
  part.cell_end = static_cast<std::uint32_t>(body.cell_count());
  body.parts.push_back(part);
  const Problem problem = springs_setting(body, {Model::springs, Model::springs});
  KernelEffects plan{{0, 0}};
  plan.fracture = {{}, {1e12, 1e12}};
  Stepper stepper(problem, plan, false);
  const State state = shaken(body, 1e-3, 8);
  const Stencil none;
  const double energy = Cells(problem, none).energy(state);
  ASSERT_TRUE(stepper.elastic_energy(state).has_value());
  EXPECT_NEAR(*stepper.elastic_energy(state), energy, 1e-12 * energy);
}

TEST(ConnectionKernel, LengthThatIsNoNumberIsTold) {
  const Body body = crumbs({9, 7, 5}, 0.9, 9);
  const Problem problem = springs_setting(body);
  for (const double bad : {std::nan(""), 1e300}) {
    State state = shaken(body, 1e-3, 10);
    state.displacement[body.cell_elements[20][3]].y() = bad;
    Stepper stepper(problem, {{0}}, false);
    EXPECT_LE(stepper.advance(state, {}, {1e-6, 1e-6, false}).smallest_jacobian, 0) << bad;
  }
}

// Springs resist as well inside out: the check between steps has to see it, but for springs that break.
TEST(ConnectionKernel, FoldedCellEndsTheStableStep) {
  const Body body = box_body({{2, 2, 2}, Vec3::Constant(0.01)});
  const Problem problem = springs_setting(body);
  State state = shaken(body, 0, 11);
  const std::vector<ActiveEffect> none;
  KernelEffects plan{{0}};
  StepBound bound(problem, none, plan);
  bound.look(state, nullptr, {});
  EXPECT_GT(bound.longest(false), 0);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e].z() = -2.1 * body.rest[e].z();  // a mirror image
  bound.look(state, nullptr, {});
  EXPECT_LE(bound.longest(false), 0);
  plan.fracture = {{1e6, 0.1}};
  bound.look(state, nullptr, {});
  EXPECT_GT(bound.longest(false), 0);
}

}  // namespace
}  // namespace flexel::simulate
