// Connections of model `paper` that break, flow, slide and are fused, against the paper's own equations.
#include "simulate/paper/connection_yield.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "formats/lattice/body_file.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/fracture.h"
#include "simulate/effects/plasticity.h"
#include "simulate/events/fused.h"
#include "simulate/input/hardening.h"
#include "simulate/matter/masses.h"
#include "simulate/paper/connection_friction.h"
#include "tests/sanitized.h"
#include "tests/scratch.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::book;
using testing::centre_body;
using testing::CentreOptions;
using testing::expect_books_close;
using testing::expect_momenta_kept;
using ::testing::HasSubstr;
using testing::refusal;
using testing::run_timed;
using testing::set_velocity;
using testing::TimedCase;

constexpr double kYoung = 1e6, kDensity = 1000, kWidth = 0.01;  // Pa, kg/m3, m

CentreOptions row_of(Index3 voxels) {
  CentreOptions options;
  options.voxels = voxels;
  options.spacing = kWidth;
  return options;
}

// Two parts of so many elements, "right" by `apart` along x from "left"; m.
Body two_parts(Index3 voxels, double apart) {
  CentreOptions options = row_of(voxels);
  options.name = "left";
  Body body = centre_body(options);
  options.name = "right";
  options.origin = Vec3(apart, 0, 0);
  append(body, centre_body(options));
  return body;
}

Problem problem_of_paper(const Body& body, Rigidity rigidity = Rigidity::none) {
  Problem problem{body, {{"gum", kYoung, 0.25, kDensity, ""}}, {}, {Model::paper}, {HookeConstant::paper},
                  {}};
  problem.rigidity.assign(1, rigidity);
  return problem;
}

// As `text` of a scene has it, of gum.
Scene yielding_scene(const std::string& text) {
  return parse_scene(
      "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.25\ndensity = \"1000 kg/m3\"\n" +
          text,
      "scene.toml");
}

// Two elements, the second drawn away by `by`; how many connections broke.
std::uint64_t broken_when_drawn(double elongation, double by, const Body& body) {
  const Problem problem = problem_of_paper(body);
  PaperModel model(problem);
  FractureLimits limits;
  limits.elongation = elongation;
  ConnectionYield yield(problem, {{0}, {}, {limits}}, model);
  const State state{{Vec3::Zero(), Vec3(by, 0, 0)}, 1, {Vec3::Zero(), Vec3::Zero()}, 0.0};
  const std::uint64_t broken = yield.advance(state).broken;
  std::vector<Vec3> forces(2, Vec3::Zero());
  model.add_forces(state, forces);
  EXPECT_EQ(forces[0].x() == 0, broken > 0);
  return broken;
}

// Section 4.2: "if its elements are a distance t apart, we destroy it".
TEST(ConnectionYield, AConnectionEndsAtItsThresholdAndNotBefore) {
  Body body = centre_body(row_of({2, 1, 1}));
  EXPECT_EQ(broken_when_drawn(0.25, 0.25 * kWidth * (1 - 1e-12), body), 0u);
  EXPECT_EQ(broken_when_drawn(0.25, 0.25 * kWidth * (1 + 1e-12), body), 1u);
  // section 3.2: the mean of the two elements'
  body.element_columns["strength_change"] = {1, {2, 0}};
  EXPECT_EQ(broken_when_drawn(0.25, 0.5 * kWidth * (1 - 1e-12), body), 0u);
  EXPECT_EQ(broken_when_drawn(0.25, 0.5 * kWidth * (1 + 1e-12), body), 1u);
  body.element_columns["strength_change"] = {1, {2, -1}};
  EXPECT_THROW((void)broken_when_drawn(0.25, 0, body), InputError);
}

// A bar whose halves fly apart: momenta, books, and two pieces in the file, which a later run begins with.
TEST(ConnectionYield, ATornBarIsTwoPiecesInTheFileToo) {
  Body body = centre_body(row_of({8, 2, 2}));
  std::vector<Vec3> velocity;
  for (const Vec3& x : body.rest) velocity.push_back(Vec3(x.x() < 4 * kWidth ? -4 : 4, 0.5, 0));
  set_velocity(body, velocity);
  const std::string torn = "[fracture]\nelongation = 0.05\n[run]\ntime = \"4 ms\"\nstep = \"1 us\"\n";
  const TimedCase made = run_timed(body, yielding_scene(torn));
  expect_books_close(made.result);
  expect_momenta_kept(made.history, 1e-9);
  EXPECT_GT(made.history.column("fracture dissipated").back(), 0);
  const auto across = [](const Body& of) {
    std::size_t count = 0;
    const Adjacency graph = element_adjacency(of);
    for (std::uint32_t e = 0; e < of.element_count(); ++e)
      for (const std::uint32_t other : graph.of(e))
        count += (of.lattice_index[e][0] < 4) != (of.lattice_index[other][0] < 4);
    return count;
  };
  EXPECT_GT(across(body), 0u);
  EXPECT_EQ(across(made.body), 0u);
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("torn_paper.vtu");
  write_body(made.body, path);
  const TimedCase later = run_timed(read_body(path), yielding_scene("[run]\ntime = \"1 ms\"\n"));
  EXPECT_EQ(across(later.body), 0u);
  const double gap = made.body.position.back().x() - made.body.position.front().x();
  EXPECT_NEAR(later.body.position.back().x() - later.body.position.front().x() - gap, 8e-3, 3e-3);
}

// A bar that is slowly pulled at both ends by 15 kPa of its first section: the mean of its plastic strain and the stretch, of
// its middle.
struct Pulled {
  TimedCase made;
  double strain = 0, stretch = 0;
};

Pulled pulled_slowly(const std::string& material, const std::string& keys) {
  const double pull = less_if_sanitized(0.3, 0.1, "a third of the time");  // s: tens of the bar's periods
  const std::string scene = material + keys +
                            fmt::format(
                                "[plasticity]\n[damping]\ntime = \"0.3 ms\"\n"
                                "[[load]]\nwhere = \"xmax\"\nforce = [\"13.5 N\", 0, 0]\ntime = [\"0 s\", "
                                "\"{} s\"]\nfactor = [0, 1]\n"
                                "[[load]]\nwhere = \"xmin\"\nforce = [\"-13.5 N\", 0, 0]\ntime = [\"0 s\", "
                                "\"{} s\"]\nfactor = [0, 1]\n"
                                "[run]\ntime = \"{} s\"\n",
                                pull, pull, pull + 0.05);
  Pulled pulled{run_timed(centre_body(row_of({14, 3, 3})), yielding_scene(scene))};
  const Body& body = pulled.made.body;
  const std::vector<double>& strain = body.element_columns.at("plastic_strain").values;
  double sum = 0, count = 0, ahead = 0, behind = 0;  // of the middle, and of the layers around it
  for (std::size_t e = 0; e < strain.size(); ++e) {
    const int layer = body.lattice_index[e][0];
    if (layer == 4) behind += body.position[e].x() / 9;
    if (layer == 9) ahead += body.position[e].x() / 9;
    if (layer <= 4 || layer >= 9) continue;
    sum += strain[e];
    count += 1;
  }
  pulled.strain = sum / count;
  pulled.stretch = (ahead - behind) / (5 * kWidth);
  return pulled;
}

// sigma = yield + hardening a at the end of a slow pull of true stress P / A0 exp(strain), and that set stays.
TEST(ConnectionYield, APulledBarFlowsAtItsYieldStress) {
  for (const char* hooke : less_if_sanitized<std::vector<const char*>>({"paper", "isotropic"}, {"paper"},
                                                                       "one constant of two")) {
    const Pulled pulled = pulled_slowly("yield = \"10 kPa\"\nhardening = \"200 kPa\"\n",
                                        fmt::format("[parts.box]\nhooke = \"{}\"\n", hooke));
    EXPECT_LT(book(pulled.made.result, "worst_residual"), 5e-3 * book(pulled.made.result, "largest_term"))
        << hooke;
    // Kirchhoff stress: P / A0 times the stretch
    const double expected = (15e3 * pulled.stretch - 10e3) / 2e5;
    EXPECT_NEAR(pulled.strain, expected, 0.05 * expected) << hooke;
    EXPECT_GT(pulled.made.history.column("plasticity dissipated").back(), 0);
    EXPECT_TRUE(pulled.made.body.element_columns.contains("connection_rest"));
  }
}

// Likewise by Voce's law, with which the bar bears 20 kPa of its first section at most, at a strain of .2.
TEST(ConnectionYield, APulledBarHardensByVocesLaw) {
  const Pulled pulled =
      pulled_slowly("yield = \"10 kPa\"\nstrength = \"20 kPa\"\nuniform_elongation = 0.2\n", "");
  EXPECT_LT(book(pulled.made.result, "worst_residual"), 5e-3 * book(pulled.made.result, "largest_term"));
  const VoceHardening voce = *voce_hardening(10e3, 20e3, 0.2, kYoung);
  const double expected = -std::log(1 - (15e3 * pulled.stretch - 10e3) / voce.saturation) / voce.rate;
  EXPECT_NEAR(pulled.strain, expected, 0.05 * expected);
  EXPECT_GT(pulled.strain, 0.02);
}

// Equation 20 on two elements: a connection pressed by F_N and slid across loses mu F_N of momentum a second on either
// side, until it stands; momentum is kept.
TEST(ConnectionYield, SlidingAcrossAConnectionIsBrakedByItsNormalForce) {
  Body body = centre_body(row_of({2, 1, 1}));
  body.position[1].x() -= 0.05 * kWidth;
  Problem problem = problem_of_paper(body);
  const PaperModel model(problem);
  const double force = kYoung * kWidth * 0.05 * kWidth, mu = 0.3, mass = kDensity * std::pow(kWidth, 3);
  std::optional<ConnectionFriction> friction = ConnectionFriction::make({{{mu, std::nullopt, ""}}}, problem);
  ASSERT_TRUE(friction.has_value());
  friction->attach(model, {0});
  State state{{Vec3::Zero(), Vec3(-0.05 * kWidth, 0, 0)}, 1, {Vec3(0, 1, 2), Vec3(0, -1, -2)}, 0.0, 1e-6};
  std::vector<Vec3> forces(2, Vec3::Zero());
  friction->add_forces(state, forces);
  EXPECT_NEAR(forces[0].norm(), mu * force, 1e-12 * force);
  EXPECT_NEAR(forces[0].dot(Vec3(0, 1, 2).normalized()), -mu * force, 1e-12 * force);
  EXPECT_EQ(forces[0], Vec3(-forces[1]));
  // no step turns the sliding round
  state.kick = 1e3 * mass / (mu * force);
  forces.assign(2, Vec3::Zero());
  friction->add_forces(state, forces);
  const Vec3 after = state.velocity[0] + state.kick / mass * forces[0];
  EXPECT_NEAR((after - (state.velocity[1] + state.kick / mass * forces[1])).norm(), 0, 1e-9);
  // along the connection there is none
  state.velocity = {Vec3(1, 0, 0), Vec3(-1, 0, 0)};
  forces.assign(2, Vec3::Zero());
  friction->add_forces(state, forces);
  EXPECT_EQ(forces[0].norm(), 0);
}

TEST(ConnectionYield, InternalFrictionTakesEnergyAndKeepsMomentum) {
  Body body = centre_body(row_of({4, 4, 4}));
  std::vector<Vec3> velocity;
  for (const Vec3& x : body.rest) velocity.push_back(Vec3(1, 2, 0) + Vec3(0, 0, 30 * (x.x() - 0.02)));
  set_velocity(body, velocity);
  const TimedCase made =
      run_timed(body, yielding_scene("[internal_friction]\ncoefficient = 0.3\n[run]\ntime = \"20 ms\"\n"));
  expect_books_close(made.result);
  for (const char* axis : {"momentum x", "momentum y", "momentum z"})
    for (const double value : made.history.column(axis))
      EXPECT_NEAR(value, made.history.column(axis)[0], 1e-9 * made.history.column("momentum y")[0]);
  EXPECT_GT(made.history.column("internal friction dissipated").back(),
            0.1 * made.history.column("kinetic")[0] * 0.01);
}

TEST(ConnectionYield, InternalFrictionIsRefusedByNameElsewhere) {
  const std::string friction = "[internal_friction]\ncoefficient = 0.3\n[run]\ntime = \"1 ms\"\n";
  EXPECT_THAT(refusal(testing::box_body({}), yielding_scene(friction)),
              HasSubstr("connections of model \"paper\""));
  EXPECT_THAT(refusal(centre_body(row_of({2, 2, 2})), yielding_scene(friction + "method = \"implicit\"\n")),
              HasSubstr("[internal_friction] of model"));
  EXPECT_THAT(
      refusal(centre_body(row_of({2, 2, 2})), yielding_scene("[internal_friction]\ncoefficient = 0.3\n")),
      HasSubstr("timed runs only"));
}

// Two blocks, elements kWidth + 1 mm apart: fused from element to element, free of force at that moment, and still so
// in a later run and at equilibrium.
TEST(ConnectionYield, FusedBlocksAreOneInLaterRunsToo) {
  CentreOptions options = row_of({3, 2, 2});
  options.name = "left";
  Body body = centre_body(options);
  options.name = "right";
  options.origin = Vec3(3 * kWidth + 1e-3, 0, 0);
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("paper_right.vtu");
  write_body(centre_body(options), path);
  set_velocity(body, std::vector<Vec3>(body.element_count(), Vec3(0.02, 0, 0)));
  const auto scene = [&](const char* within) {
    return yielding_scene("[run]\ntime = \"50 ms\"\n[[event]]\nat = \"0 s\"\ndo = \"add\"\nbody = \"" + path +
                          "\"\n[[event]]\nat = \"0 s\"\ndo = \"fuse\"\nwithin = \"" + within + "\"\n");
  };
  EXPECT_THAT(refusal(body, scene("10.9 mm")), HasSubstr("from element to element"));
  const TimedCase made = run_timed(body, scene("15 mm"));
  expect_books_close(made.result);
  expect_momenta_kept(made.history, 1e-9);
  EXPECT_EQ(fused_points(made.body).size(), 12u) << "straight ones and diagonals";
  const std::size_t last = made.body.element_count() - 1;
  EXPECT_NEAR(made.body.position[last].x() - made.body.rest[last].x(), 0.01 * 0.05, 2e-4);
  const std::string fused = scratch.path("paper_fused.vtu");
  write_body(made.body, fused);
  Body later = read_body(fused);
  EXPECT_EQ(fused_points(later).size(), 12u);
  later.element_columns.erase("velocity");
  later.position = later.rest;
  const std::string pull =
      "[[fix]]\nwhere = \"left/xmin\"\n[[load]]\nwhere = \"right/xmax\"\nforce = [\"0.1 N\", 0, 0]\n";
  (void)testing::simulate_quietly(later, yielding_scene(pull));
  EXPECT_GT(later.position[last].x() - later.rest[last].x(), 0);
  EXPECT_LT(later.position[last].x() - later.rest[last].x(), 0.1 * kWidth);
}

TEST(ConnectionYield, FusedConnectionsHaveTheMeansOfTheirElements) {
  Body body = two_parts({1, 1, 1}, 1.1 * kWidth);
  const double length = 1.1 * kWidth, stiffness = 50;
  const std::vector<FusedPoint> points = {{{0, 1}, {1, -1}, stiffness, length}, {{0, 1}, {1, -1}, 3.0, 0.0}};
  KernelEffects plan;
  plan.damping = {1e-3, 3e-3};
  plan.fracture = {{1e9, 0.1}, {1e9, 0.3}};
  body.element_columns["strength_change"] = {1, {1, 0}};
  body.element_columns["damping_change"] = {1, {0, 1}};
  const auto fused = std::make_shared<FusedConnections>(fused_connections(body, points, plan, {0.2, 0.4}));
  EXPECT_DOUBLE_EQ(fused->damping[0], 3.5e-3);
  EXPECT_DOUBLE_EQ(fused->friction[0], 0.3);
  EXPECT_DOUBLE_EQ(fused->elongation[0], 0.25);
  EXPECT_EQ(fused->damping[1], 0) << "without a length it is no connection";
  EXPECT_FALSE(std::isfinite(fused->elongation[1]));
  FusedPoints held(body, fused);
  const std::vector<double> mass = {1e-3, 1e-3};
  std::optional<FusedLosses> losses = FusedLosses::make(body, fused, mass);
  ASSERT_TRUE(losses.has_value());
  // drawn apart by a tenth, at rates along and across it
  const double apart = 0.1 * length;
  State state{{Vec3::Zero(), Vec3(apart, 0, 0)}, 1, {Vec3::Zero(), Vec3(0.1, 0, 0.2)}, 0.0, 1e-9};
  std::vector<Vec3> forces(2, Vec3::Zero());
  losses->add_forces(state, forces);
  const double damping = 3.5e-3 * stiffness * 0.1;
  EXPECT_NEAR(forces[1].x(), -damping, 1e-12);
  EXPECT_NEAR(forces[1].z(), -0.3 * (stiffness * apart + damping), 1e-12);
  EXPECT_EQ(forces[0], Vec3(-forces[1]));
  state.kick = 1e3;  // no step turns the motion round
  forces.assign(2, Vec3::Zero());
  losses->add_forces(state, forces);
  const Vec3 after = state.velocity[1] - state.velocity[0] + state.kick / 1e-3 * (forces[1] - forces[0]);
  EXPECT_NEAR(after.norm(), 0, 1e-9);
  EXPECT_EQ(held.tear(state).broken, 0u);
  state.displacement[1].x() = 0.26 * length;
  state.kick = 0;
  const ConnectionLosses torn = held.tear(state);
  EXPECT_EQ(torn.broken, 1u);
  EXPECT_NEAR(torn.released, 0.5 * stiffness * std::pow(0.26 * length, 2), 1e-12);
  EXPECT_EQ(held.left().size(), 1u);
  forces.assign(2, Vec3::Zero());
  losses->add_forces(state, forces);
  EXPECT_EQ(forces[1].norm(), 0);
  FusedPoints again(body,
                    std::make_shared<FusedConnections>(fused_connections(body, points, plan, {0.2, 0.4})));
  again.restore(held.memory());
  EXPECT_EQ(again.left().size(), 1u);
}

TEST(ConnectionYield, FusedBlocksTearAndLoseEnergy) {
  Body body = two_parts({3, 2, 2}, 3 * kWidth);
  std::vector<Vec3> velocity(body.element_count(), Vec3::Zero());
  for (std::uint32_t e = body.parts[1].element_begin; e < body.element_count(); ++e) velocity[e].x() = 12;
  set_velocity(body, velocity);
  const std::string fuse = "[[event]]\nat = \"0 s\"\ndo = \"fuse\"\nwithin = \"11 mm\"\n";
  const std::string damped = "[damping]\ntime = \"0.1 ms\"\n", run = "[run]\ntime = \"20 ms\"\n";
  for (const char* method : {"", "method = \"implicit\"\nstep = \"20 us\"\n"}) {
    const TimedCase whole = run_timed(body, yielding_scene(damped + run + method + fuse));
    expect_books_close(whole.result);
    EXPECT_EQ(fused_points(whole.body).size(), 4u);
    EXPECT_GT(whole.history.column("fused damping dissipated").back(), 0);
  }
  const TimedCase torn =
      run_timed(body, yielding_scene("[fracture]\nelongation = 0.05\n" + damped + run + fuse));
  expect_books_close(torn.result);
  expect_momenta_kept(torn.history, 1e-9);
  EXPECT_TRUE(fused_points(torn.body).empty()) << "a later run begins in two pieces";
  EXPECT_GT(torn.history.column("fracture dissipated").back(), 0);
}

TEST(ConnectionYield, RigidPartsHaveNoConnections) {
  const Body body = centre_body(row_of({3, 3, 3}));
  EXPECT_FALSE(PaperModel(problem_of_paper(body)).rows().entries.empty());
  for (const Rigidity rigidity : {Rigidity::free, Rigidity::led}) {
    const Problem problem = problem_of_paper(body, rigidity);
    const PaperModel model(problem);
    EXPECT_TRUE(model.rows().entries.empty());
    EXPECT_EQ(model.frequencies({std::vector<Vec3>(27, Vec3::Zero())}, lumped_masses(problem))[0], 0);
  }
}

}  // namespace
}  // namespace flexel::simulate
