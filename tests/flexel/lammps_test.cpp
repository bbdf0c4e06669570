// What LAMMPS is given pulls as the models do, and what it gives back is read or refused line by line.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <random>

#include "base/error.h"
#include "flexel/lammps/dump.h"
#include "flexel/lammps/imported.h"
#include "flexel/lammps/input_files.h"
#include "flexel/lammps/springs.h"
#include "simulate/models/cells.h"
#include "simulate/models/paper_model.h"
#include "simulate/models/stiffness.h"
#include "tests/scratch.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"

namespace flexel::lammps {
namespace {

using ::testing::HasSubstr;

constexpr double kSpacing = 0.01;  // m

simulate::Problem problem_of_model(const Body& body, simulate::Model model) {
  simulate::Material gum;
  gum.young = 1.2e6;
  gum.poisson = 0.25;
  gum.density = 930;
  return {body, {gum}, {}, {model}, {simulate::HookeConstant::paper}, {}, {}, {}, {}};
}

// A third of the cells partly filled, in a lattice that is turned.
Body some_cells(std::mt19937& random) {
  simulate::testing::BoxOptions options;
  options.cells = {4, 3, 3};
  options.spacing = Vec3::Constant(kSpacing);
  options.axes = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  std::uniform_real_distribution<double> any(0, 1);
  options.fill = [&any, &random, fills = std::map<std::array<int, 3>, double>()](int i, int j,
                                                                                 int k) mutable {
    const auto [found, fresh] = fills.try_emplace({i, j, k}, 0);
    if (fresh) found->second = any(random) < 0.3 ? 0.1 + 0.8 * any(random) : any(random) < 0.15 ? 0 : 1;
    return found->second;
  };
  return simulate::testing::box_body(options);
}

simulate::State moved(const Body& body, std::mt19937& random) {
  std::uniform_real_distribution<double> any(-0.2 * kSpacing, 0.2 * kSpacing);
  simulate::State state;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    state.displacement.emplace_back(any(random), any(random), any(random));
    state.velocity.emplace_back(any(random), any(random), any(random));
  }
  return state;
}

struct Pulls {
  std::vector<Vec3> elastic, damping;  // (elements) N
};

Pulls pulls_of(const std::vector<Spring>& springs, const Body& body, const simulate::State& state) {
  Pulls pulls{std::vector<Vec3>(body.element_count(), Vec3::Zero()),
              std::vector<Vec3>(body.element_count(), Vec3::Zero())};
  for (const Spring& spring : springs) {
    const Vec3 along = body.rest[spring.b] + state.displacement[spring.b] - body.rest[spring.a] -
                       state.displacement[spring.a];
    const Vec3 pull = spring.stiffness * (along.norm() - spring.length) * along.normalized();
    const double rate = along.normalized().dot(state.velocity[spring.b] - state.velocity[spring.a]);
    pulls.elastic[spring.a] += pull;
    pulls.elastic[spring.b] -= pull;
    pulls.damping[spring.a] += spring.damping * rate * along.normalized();
    pulls.damping[spring.b] -= spring.damping * rate * along.normalized();
  }
  return pulls;
}

double farthest(const std::vector<Vec3>& one, const std::vector<Vec3>& other) {
  double most = 0;
  for (std::size_t e = 0; e < one.size(); ++e) most = std::max(most, (one[e] - other[e]).norm());
  return most;
}

double largest(const std::vector<Vec3>& forces) {
  return farthest(forces, std::vector<Vec3>(forces.size(), Vec3::Zero()));
}

std::vector<Vec3> forces_of_cells(const simulate::Problem& problem, const simulate::State& state) {
  const std::vector<std::uint8_t> active = simulate::active_cells(problem);
  const simulate::ConnectionRows none = simulate::connection_rows({}, problem.body.element_count());
  const simulate::StiffnessPattern pattern =
      simulate::stiffness_pattern(problem.body, active, none, {}, false);
  simulate::Cells cells(problem, pattern.stencil);
  std::vector<Vec3> forces(problem.body.element_count(), Vec3::Zero());
  cells.add_forces(state, forces);
  return forces;
}

TEST(Lammps, SpringsOfCellsPullAsTheCellsDo) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Body body = some_cells(random);
    if (trial % 2 == 1) {  // springs that flowed, and some that broke
      std::uniform_real_distribution<double> any(-0.1 * kSpacing, 0.1 * kSpacing);
      Column flow, broken;
      flow.components = 28;
      for (std::size_t i = 0; i < 28 * body.cell_count(); ++i) flow.values.push_back(any(random));
      broken.components = 1;
      for (std::size_t c = 0; c < body.cell_count(); ++c)
        broken.values.push_back(static_cast<double>(random() % (1U << 28) & random()));
      body.cell_columns = {{"spring_flow", flow}, {"broken_springs", broken}};
    }
    body.broken[0] = 1;
    const simulate::Problem problem = problem_of_model(body, simulate::Model::springs);
    const simulate::State state = moved(body, random);
    const std::vector<Vec3> ours = forces_of_cells(problem, state);
    const Pulls pulls = pulls_of(springs_of(problem, {0}), body, state);
    EXPECT_GT(largest(ours), 1e-3);
    EXPECT_LT(farthest(ours, pulls.elastic), 1e-12 * largest(ours)) << trial;
    EXPECT_EQ(largest(pulls.damping), 0);
  }
}

TEST(Lammps, DampingIsTauTimesTheStiffness) {
  std::mt19937 random(4);
  const Body body = some_cells(random);
  for (const Spring& spring : springs_of(problem_of_model(body, simulate::Model::springs), {2e-5}))
    EXPECT_NEAR(spring.damping, 2e-5 * spring.stiffness, 1e-15 * spring.stiffness);
}

TEST(Lammps, ConnectionsOfThePaperPullAsTheModelDoes) {
  std::mt19937 random(5);
  simulate::testing::CentreOptions options;
  options.voxels = {4, 3, 3};
  options.spacing = kSpacing;
  options.inside = [](int i, int j, int k) { return (i + 2 * j + 3 * k) % 7 != 3; };
  Body body = simulate::testing::centre_body(options);
  std::uniform_real_distribution<double> any(-0.1, 0.1);
  for (const auto& [name, scale] : {std::pair{"connection_stiffness_change", 5.0},
                                    {"connection_damping_change", 5.0},
                                    {"connection_rest", kSpacing}}) {
    Column& column = body.element_columns[name];
    column.components = 13;
    for (std::size_t i = 0; i < 13 * body.element_count(); ++i) column.values.push_back(scale * any(random));
  }
  const simulate::Problem problem = problem_of_model(body, simulate::Model::paper);
  const simulate::State state = moved(body, random);
  const simulate::PaperModel model(problem);
  std::vector<Vec3> elastic(body.element_count(), Vec3::Zero()), damping = elastic;
  model.add_forces(state, elastic);
  model.add_damping(state, {3e-5}, damping);
  const Pulls pulls = pulls_of(springs_of(problem, {3e-5}), body, state);
  EXPECT_LT(farthest(elastic, pulls.elastic), 1e-12 * largest(elastic));
  EXPECT_LT(farthest(damping, pulls.damping), 1e-12 * largest(damping));
  EXPECT_GT(largest(damping), 0);
}

TEST(Lammps, BondsOfOneTypeAreAlike) {
  std::mt19937 random(6);
  const Body body = some_cells(random);
  const std::vector<Spring> springs = springs_of(problem_of_model(body, simulate::Model::springs), {1e-5});
  const BondTypes types = bond_types(springs);
  EXPECT_LT(types.types.size(), springs.size());
  ASSERT_EQ(types.of.size(), springs.size());
  for (std::size_t s = 0; s < springs.size(); ++s) {
    const Spring& type = types.types[types.of[s]];
    EXPECT_EQ(std::tie(type.stiffness, type.length, type.damping),
              std::tie(springs[s].stiffness, springs[s].length, springs[s].damping));
  }
}

// By turns about the axis: d = f T + sin(f angle) arm + (1 - cos(f angle)) back is what the motion does.
TEST(Lammps, TurnsAreThoseOfTheMotion) {
  simulate::Motion motion;
  motion.translation = {1, -2, 0.5};
  motion.axis = Vec3(1, -1, 2).normalized();
  motion.through = {0.3, 0.1, -0.2};
  motion.angle = 2.1;
  const Vec3 from(0.7, -0.4, 1.1);
  for (const double f : {-1.0, 0.0, 0.3, 1.0, 2.5}) {
    const Vec3 ours = motion.displacement(from, f);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Turn turn = turn_of(motion, from, axis);
      const auto i = static_cast<Eigen::Index>(axis);
      EXPECT_NEAR(ours[i],
                  f * motion.translation[i] + std::sin(f * motion.angle) * turn.arm +
                      (1 - std::cos(f * motion.angle)) * turn.back,
                  1e-14);
    }
  }
}

std::string head_of(int step) {
  return fmt::format(
      "ITEM: TIME\n0.5\nITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ss ss ss\n0 1\n0 1\n0 "
      "1\n",
      step);
}
const std::string kHead = head_of(10);
constexpr const char* kAtoms = "ITEM: ATOMS id x y z vx vy vz\n";

std::string read_with(const std::string& text) {
  const test::Scratch folder;
  const std::string path = folder.path("run.dump");
  std::ofstream(path) << text;
  try {
    DumpReader reader(path, 2);
    while (reader.next()) {
    }
  } catch (const InputError& error) {
    return error.where().substr(error.where().rfind('/') + 1) + ": " + error.what();
  }
  return "read";
}

TEST(Lammps, ADumpGivesBackItsNumbersInTheOrderOfTheElements) {
  const test::Scratch folder;
  const std::string path = folder.path("run.dump");
  std::ofstream(path)
      << kHead << "ITEM: ATOMS vx id z y x vy vz\n1 2 0.30000000000000004 -1e-300 5 6 7\n8 1 9 10 11 12 13\n"
      << head_of(20) << "ITEM: ATOMS id x y z\n1 1 2 3\n2 4 5 6\n";
  DumpReader reader(path, 2);
  const std::optional<DumpFrame> first = reader.next(), second = reader.next();
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(first->step, 10U);
  EXPECT_EQ(first->time, 0.5);
  EXPECT_EQ(first->position[0], Vec3(11, 10, 9));
  EXPECT_EQ(first->position[1], Vec3(5, -1e-300, 0.30000000000000004));
  EXPECT_EQ(first->velocity[0], Vec3(8, 12, 13));
  EXPECT_TRUE(second->velocity.empty());
}

TEST(Lammps, WhatIsWrongWithADumpIsToldWithItsLine) {
  const std::string good = kHead + kAtoms + "1 1 2 3 4 5 6\n2 1 2 3 4 5 6\n";
  EXPECT_EQ(read_with(good), "read");
  const std::string later = head_of(20) + kAtoms + "1 1 2 3 4 5 6\n2 1 2 3 4 5 6\n";
  EXPECT_EQ(read_with(good + later), "read");
  const auto refused = [](const std::string& text, const std::string& where, const std::string& what) {
    EXPECT_THAT(read_with(text), HasSubstr(where));
    EXPECT_THAT(read_with(text), HasSubstr(what));
  };
  const std::string atoms = kHead + kAtoms;
  refused("solid box\n", "run.dump:1", "ITEM");
  refused(atoms + "1 1 2 3 4 5 6\n", "run.dump:12", "ends within a frame");
  refused(atoms + "1 1 2 3 4 5 6\n2 1 2 3 4 5 6", "run.dump",
          "ends within a frame");  // cut off in the last number
  refused(atoms + "1 1 2 3 4 5 6\n1 1 2 3 4 5 6\n", "run.dump:13", "twice");
  refused(atoms + "1 1 2 3 4 5 6\n3 1 2 3 4 5 6\n", "run.dump:13", "none of the body's 2");
  refused(atoms + "1 1 2 nan 4 5 6\n", "run.dump:12", "shorter step");
  refused(atoms + "1 1 2 3x 4 5 6\n", "run.dump:12", "no number");
  refused(atoms + "1 1 2 3 4 5\n", "run.dump:12", "6 columns, not 7");
  refused(kHead + "ITEM: ATOMS id x y\n", "run.dump:11", "no column \"z\"");
  refused("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n3\n", "run.dump:4", "3 atoms, but the body has 2");
  refused(good + good, "run.dump:24", "step 10 is not later than step 10");
  refused(later + good, "run.dump:24", "step 10 is not later than step 20");
  refused(kHead + "ITEM: ATOMS id x y z vx vy\n", "run.dump:11", "all or none");
  // What it says of a frame that is cut off leaves a dump that is read.
  for (std::size_t cut = good.size() + 1; cut < good.size() + later.size(); ++cut)
    refused((good + later).substr(0, cut), "run.dump", "remove line 14 and those behind it");
  refused("ITEM: UNITS\nlj\n", "run.dump:2", "units lj");
  refused("ITEM: TIMESTEP\n-1\n", "run.dump:2", "whole number");
  refused("ITEM: TIMESTEP\n99999999999999999999\n", "run.dump:2", "whole number");
  refused("ITEM: TIMESTEP\n0\nITEM: TIMESTEP\n1\n", "run.dump:3", "twice in one frame");
  refused(std::string(kAtoms) + "1 1 2 3 4 5 6\n2 1 2 3 4 5 6\n", "run.dump:1", "no \"ITEM: TIMESTEP\"");
  refused(std::string("ITEM: TIMESTEP\n0\n") + kAtoms, "run.dump:3", "no \"ITEM: NUMBER OF ATOMS\"");
  refused(kHead + "ITEM: ATOMSid x y z\n", "run.dump:11", "no line \"ITEM: ...\"");
  refused(atoms + "1 1 2 3e12 4 5 6\n", "run.dump:12", "shorter step");
  refused(atoms + "1 1 2 3 4 5 6e35\n", "run.dump:12", "shorter step");
  const auto of_run = [](int step, const char* run) {
    return head_of(step) + "ITEM: ATOMS id x y z v_flexel" + run + "\n1 1 2 3 0\n2 1 2 3 0\n";
  };
  EXPECT_EQ(read_with(of_run(1, "0a") + of_run(2, "0a")), "read");
  refused(of_run(1, "0a") + of_run(2, "0b"), "run.dump:24", "another run");
}

TEST(Lammps, MatterThatIsInsideOutIsSeen) {
  simulate::testing::BoxOptions options;
  options.cells = {2, 2, 2};
  Body cells = simulate::testing::box_body(options);
  simulate::testing::CentreOptions voxels;
  voxels.voxels = {3, 3, 3};
  for (Body body : {cells, simulate::testing::centre_body(voxels)}) {
    EXPECT_FALSE(inside_out(body));
    for (std::size_t e = 0; e < body.element_count(); ++e) body.position[e].x() *= -1;
    EXPECT_TRUE(inside_out(body));
  }
}

}  // namespace
}  // namespace flexel::lammps
