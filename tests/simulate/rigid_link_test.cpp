// Loads through a rigid link: the loaded face moves as one rigid body, in balance with its force and torque.
#include "simulate/conditions/rigid_link.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/program/brief_output.h"
#include "simulate/conditions/link_stability.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

constexpr const char* kNoContraction =
    "material = \"it\"\n[materials.it]\nyoung = \"210 GPa\"\npoisson = 0\ndensity = \"7850 kg/m3\"\n";
constexpr const char* kHeld =
    "[[fix]]\nwhere = { half_space = { point = [0, 0, 0], normal = [-1, 0, 0] } }\n";

SimulateResult solve(Body& body, const std::string& scene) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions how;
  how.estimate = false;
  return simulate(body, parse_scene(scene, "s.toml"), how, progress);
}

std::string link(const std::string& rest, const std::string& kind = "rigid") {
  return "[[load]]\nwhere = \"box/x1\"\nlink = \"" + kind + "\"\n" + rest + "\n";
}

Mat3 turned_by(const Vec3& rotation) {
  const double angle = rotation.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix() : Mat3(Mat3::Identity());
}

// Largest distance [m] of the elements at x = `x` from where the link takes them.
double out_of_place(const Body& body, const AppliedLoad& load, const Vec3& at, double x) {
  const Mat3 turned = turned_by(*load.rotation);
  double most = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (std::abs(body.rest[e].x() - x) < 1e-9)
      most =
          std::max(most, (body.position[e] - at - *load.displacement - turned * (body.rest[e] - at)).norm());
  return most;
}

// Without contraction across, a cantilever under an end moment is bent evenly: theta = M L / (E I), and the
// end goes theta L / 2.
TEST(RigidLink, EndMomentBendsACantilever) {
  Body body = testing::box_body({.cells = {20, 4, 4}, .spacing = Vec3::Constant(0.005)});
  const SimulateResult result =
      solve(body, std::string(kNoContraction) + kHeld + link("torque = [0, \"10 N m\", 0]"));
  const double theta = 10 * 0.1 / (210e9 * std::pow(0.02, 4) / 12);
  const AppliedLoad& load = result.loads[0];
  EXPECT_LT((*load.rotation - Vec3(0, theta, 0)).norm(), 2e-3 * theta);
  EXPECT_LT((*load.displacement - Vec3(0, 0, -theta * 0.05)).norm(), 2e-3 * theta * 0.05);
  EXPECT_LT(out_of_place(body, load, Vec3(0.1, 0.01, 0.01), 0.1), 1e-6 * result.largest_displacement);
  EXPECT_LE(result.newton_iterations, 6);  // the links' slope is that of the body
}

TEST(RigidLink, ARemoteForceIsAForceAndItsMoment) {
  testing::BoxOptions options{.cells = {6, 3, 3}, .spacing = Vec3::Constant(0.005)};
  Body remote = testing::box_body(options), near = testing::box_body(options);
  const std::string scene = std::string("material = \"steel\"\n") + kHeld;
  const SimulateResult far =
      solve(remote, scene + link("force = [0, 0, \"20 N\"]\nat = [\"130 mm\", \"7.5 mm\", \"7.5 mm\"]"));
  const SimulateResult same =
      solve(near, scene + link("force = [0, 0, \"20 N\"]\ntorque = [0, \"-2 N m\", 0]"));
  for (std::size_t e = 0; e < near.element_count(); ++e)
    EXPECT_LT((remote.position[e] - near.position[e]).norm(), 1e-6 * far.largest_displacement);
  // The remote point goes further: with the link.
  EXPECT_LT((*far.loads[0].displacement - *same.loads[0].displacement -
             (turned_by(*same.loads[0].rotation) - Mat3::Identity()) * Vec3(0.1, 0, 0))
                .norm(),
            1e-5 * far.loads[0].displacement->norm());
}

TEST(RigidLink, IsStifferThanAnAveragingLink) {
  const std::string scene = std::string("material = \"steel\"\n") + kHeld;
  const std::string load =
      "force = [0, \"20 N\", 0]\nat = [\"40 mm\", 0, \"10 mm\"]\ntorque = [\"1 N m\", 0, 0]";
  double energy[2];
  for (const bool rigid : {false, true}) {
    Body body = testing::box_body({.cells = {4, 4, 4}, .spacing = Vec3::Constant(0.005)});
    energy[rigid] = solve(body, scene + link(load, rigid ? "rigid" : "averaging")).elastic_energy;
  }
  EXPECT_LT(energy[1], 0.99 * energy[0]);
  EXPECT_GT(energy[1], 0.5 * energy[0]);
}

// What a force moves about an axis, a torque about it moves along the force (Betti 1872).
TEST(RigidLink, AnswersAreReciprocal) {
  testing::BoxOptions options{.cells = {8, 3, 2}, .spacing = Vec3::Constant(0.005)};
  const std::string scene = std::string("material = \"steel\"\n") + kHeld;
  Body pushed = testing::box_body(options), turned = testing::box_body(options);
  const std::string at = "at = [\"60 mm\", \"30 mm\", \"-10 mm\"]\n";
  const AppliedLoad push = solve(pushed, scene + link(at + "force = [0, 0, \"1 N\"]")).loads[0];
  const AppliedLoad turn =
      solve(turned, scene + link(at + "force = [0, 0, 0]\ntorque = [0, \"1 N m\", 0]")).loads[0];
  EXPECT_NEAR(turn.displacement->z() / push.rotation->y(), 1, 1e-4);
}

// Far out: half the way to a quarter of a circle, exact for an inextensible bar.
TEST(RigidLink, LargeRotation) {
  Body body = testing::box_body({.cells = {40, 2, 2}, .spacing = Vec3::Constant(0.0025)});
  const double moment = 210e9 * std::pow(0.005, 4) / 12 * (M_PI / 2) / 0.1;
  const SimulateResult result =
      solve(body, std::string(kNoContraction) + kHeld +
                      link("torque = [0, \"" + std::to_string(moment) + " N m\", 0]"));
  const AppliedLoad& load = result.loads[0];
  EXPECT_NEAR(load.rotation->y(), M_PI / 2, 0.02);
  const double way = 2 * 0.1 / M_PI;
  EXPECT_LT((*load.displacement - Vec3(way - 0.1, 0, -way)).norm(), 0.01 * 0.1);
  EXPECT_LT(out_of_place(body, load, Vec3(0.1, 0.0025, 0.0025), 0.1), 1e-6 * result.largest_displacement);
}

// A turned bar with two links that share an edge, bent far: loads and reactions balance where it is.
TEST(RigidLink, ReactionsBalance) {
  testing::BoxOptions options{.cells = {8, 3, 3}, .spacing = Vec3::Constant(0.005)};
  options.axes = Eigen::AngleAxisd(0.5, Vec3(1, 2, 0.5).normalized()).toRotationMatrix();
  Body body = testing::box_body(options);
  const SimulateResult result = solve(
      body,
      "material = \"rubber\"\n[[fix]]\nwhere = \"box/x0\"\n" +
          link("force = [\"1 N\", \"-0.5 N\", \"0.5 N\"]\nat = [\"60 mm\", \"30 mm\", \"-20 mm\"]\n"
               "torque = [0, \"0.02 N m\", 0]") +
          "[[load]]\nwhere = { sphere = { centre = [0, 0, 0], radius = \"12 mm\" } }\nlink = \"rigid\"\n"
          "torque = [\"0.01 N m\", 0, 0]\n[gravity]\nacceleration = [0, 0, \"-9.81 m/s2\"]\n");
  double force = 0, moment = 0;
  for (const Reaction& reaction : result.reactions) {
    force += reaction.force.norm();
    moment += reaction.moment.norm();
  }
  EXPECT_GT(result.largest_displacement, 1e-3);
  EXPECT_LT(result.imbalance.norm(), 1e-6 * force);
  EXPECT_LT(result.moment_imbalance.norm(), 1e-6 * moment);
}

std::string told_of(Body& body, const std::string& scene) {
  const KeptWarnings kept;
  solve(body, scene);
  std::string told;
  for (const std::string& line : kept.lines()) told += line + "\n";
  return told;
}

// What else acts may weigh more on a link than its own load: the bar sags as far as without one, and nothing is told of buckling.
TEST(RigidLink, WeightBesideALink) {
  const testing::BoxOptions options{.cells = {20, 2, 2}, .spacing = Vec3::Constant(0.005)};
  const std::string weight =
      std::string("material = \"rubber\"\n") + kHeld + "[gravity]\nacceleration = [0, 0, \"-9.81 m/s2\"]\n";
  Body linked = testing::box_body(options), free = testing::box_body(options);
  const std::string told = told_of(linked, weight + link("force = [0, 0, \"-0.001 N\"]"));
  EXPECT_EQ(told.find("buckle"), std::string::npos) << told;
  solve(free, weight + link("force = [0, 0, \"-0.001 N\"]", "averaging"));
  double farthest = 0, apart = 0;
  for (std::size_t e = 0; e < free.element_count(); ++e) {
    farthest = std::max(farthest, (free.position[e] - free.rest[e]).norm());
    apart = std::max(apart, (linked.position[e] - free.position[e]).norm());
  }
  EXPECT_GT(farthest, 5e-3);
  EXPECT_LT(apart, 0.03 * farthest);
}

// Loads that follow have no energy, and the tangent that links are asked with does not have them.
TEST(RigidLink, BesideLoadsThatFollowNothingIsClaimed) {
  const testing::BoxOptions options{.cells = {8, 2, 2}, .spacing = Vec3::Constant(0.005)};
  const std::string scene = std::string("material = \"steel\"\n") + kHeld + link("force = [0, \"1 N\", 0]");
  Body alone = testing::box_body(options), beside = testing::box_body(options);
  EXPECT_EQ(told_of(alone, scene), "");
  EXPECT_THAT(
      told_of(beside, scene + "[[load]]\nwhere = \"box/z1\"\npressure = \"1 kPa\"\nfollower = true\n"),
      HasSubstr("was not found out"));
}

// A column pressed along its axis stays straight, so only what is asked of the tangent tells that it buckles. Through a rigid
// arm as long as itself, k L tan(k L) = 1 with k^2 = P / (E I): at .740 E I / L^2, and without one at pi^2 / 4.
TEST(RigidLink, AColumnThatBucklesWithItsLinkIsTold) {
  struct Case {
    const char* model;
    double arm, load;  // L, E I / L^2
    bool stable;
  };
  const double length = 0.1, bending = 210e9 * std::pow(0.01, 4) / 12;
  for (const Case& each :
       {Case{"cells", 0, 2.2, true}, Case{"cells", 0, 2.8, false}, Case{"cells", 1, 0.66, true},
        Case{"cells", 1, 0.82, false}, Case{"springs", 0, 3.6, false}, Case{"quadratic", 1, 0.66, true},
        Case{"quadratic", 1, 0.82, false}}) {
    Body body = testing::box_body({.cells = {20, 2, 2}, .spacing = Vec3::Constant(0.005)});
    const bool springs = std::string(each.model) == "springs";
    std::string material = kNoContraction;
    if (springs) material.replace(material.find("poisson = 0"), 11, "poisson = 0.25");
    const std::string told =
        told_of(body, std::string("model = \"") + each.model + "\"\n" + material + kHeld +
                          link(fmt::format("force = [\"{} N\", 0, 0]\nat = [\"{} m\", \"5 mm\", \"5 mm\"]",
                                           -each.load * bending / length / length, (1 + each.arm) * length)));
    EXPECT_EQ(told.find("not stable") == std::string::npos, each.stable)
        << each.model << ", arm " << each.arm << ", load " << each.load << ": " << told;
  }
}

// A torque that keeps its direction has no energy: where its stiffness is not symmetric, the symmetric part that drives a motion
// away is no proof.
TEST(RigidLink, WhatATorqueWithoutEnergyDoesIsNotClaimed) {
  const RigidLink link;
  const std::array<const RigidLink*, 1> links = {&link};
  const auto asked = [&](double first, double second, double skew) {
    Eigen::MatrixXd resists = Eigen::MatrixXd::Identity(6, 6);
    resists(4, 4) = first;
    resists(5, 5) = second;
    resists(4, 5) = skew;
    resists(5, 4) = -skew;
    return link_motions_are_stable(-resists, links);
  };
  EXPECT_EQ(asked(1, 2, 0), true);
  EXPECT_EQ(asked(1, 2, 5), true);  // nothing branches off, whatever is without energy
  EXPECT_EQ(asked(-1, 2, 0), false);
  EXPECT_EQ(asked(-1, -2, 0), false);
  EXPECT_EQ(asked(-1, -2, 1e-9), false);  // as differences leave it
  EXPECT_EQ(asked(-1, 2, 1), false);      // its determinant is below 0
  EXPECT_EQ(asked(-1, 2, 2), std::nullopt);
  EXPECT_EQ(asked(-1, -2, 1), std::nullopt);
}

// The end of a wire a thousand times as long as thick goes as far through its rigid link as without one, though rounding leaves
// the link more than the tolerance; free, it is told from that.
TEST(RigidLink, AWireResistsAndAFreeOneDoesNot) {
  const testing::BoxOptions cubes{.cells = {1000, 1, 1}, .spacing = Vec3::Constant(0.001)},
      stretched{.cells = {400, 1, 1}, .spacing = Vec3(0.0025, 0.001, 0.001)};
  for (const auto& [options, newtons] :
       {std::pair(cubes, 1e-5), std::pair(stretched, 1e-5), std::pair(stretched, 1e-3)}) {
    const std::string force = fmt::format("force = [0, 0, \"{} N\"]", newtons);
    Body linked = testing::box_body(options), averaged = testing::box_body(options);
    const SimulateResult through = solve(linked, kNoContraction + (kHeld + link(force)));
    const SimulateResult without = solve(averaged, kNoContraction + (kHeld + link(force, "averaging")));
    EXPECT_NEAR(through.largest_displacement, without.largest_displacement,
                1e-3 * without.largest_displacement);
  }
  Body free = testing::box_body(cubes);
  EXPECT_THROW((void)solve(free, kNoContraction + link("force = [0, 0, \"1e-5 N\"]")), InputError);
}

// Even bending: theta = M L / (E I), however far it goes.
TEST(RigidLink, AStripIsRolledByAQuarterTurn) {
  const double quarter = 0.5 * std::numbers::pi, torque = 210e9 * 0.002 * 1e-9 / 12 * quarter / 0.1;
  for (const char* follower : {"", "\nfollower = true"}) {
    Body body = testing::box_body({.cells = {100, 2, 1}, .spacing = Vec3::Constant(0.001)});
    const SimulateResult found =
        solve(body, kNoContraction +
                        (kHeld + link(fmt::format("torque = [0, \"{} N m\", 0]{}", -torque, follower))));
    EXPECT_NEAR(-found.loads.at(0).rotation->y(), quarter, 1e-3 * quarter) << follower;
  }
}

// Nothing holds the bar but the link, of a lattice that fits it and of one that is turned against its
// surface.
TEST(RigidLink, RefusesWhatNothingHolds) {
  for (const double turn : {0.0, 0.3}) {
    testing::BoxOptions options{.cells = {8, 3, 3}, .spacing = Vec3::Constant(0.005)};
    Body body = testing::box_body(options);
    // the surface alone, about the bar's middle: its points lie inside cells then
    for (Vec3& vertex : body.surface.vertices)
      vertex = Eigen::AngleAxisd(turn, Vec3::UnitX()) * (vertex - Vec3(0.02, 0.0075, 0.0075)) *
                   (turn > 0 ? 0.9 : 1) +
               Vec3(0.02, 0.0075, 0.0075);
    try {
      (void)solve(body, "material = \"steel\"\n" + link("torque = [0, \"1 N m\", 0]"));
      ADD_FAILURE() << "accepted, turned by " << turn;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("is free to")) << turn;
    }
  }
}

TEST(RigidLink, RefusesWhatDoesNotFit) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      Body body = testing::box_body();
      (void)solve(body, "material = \"steel\"\n" + text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string fix = "[[fix]]\nwhere = \"box/x0\"\n";
  EXPECT_THAT(message(link("force = [\"1 N\", 0, 0]")), HasSubstr("free to"));
  EXPECT_THAT(message(fix + link("force = [\"1 N\", 0, 0]") + "[run]\ntime = \"1 ms\"\n"),
              HasSubstr("needs equilibrium"));
  EXPECT_THAT(message("[[fix]]\nwhere = \"box/x1\"\n" + link("force = [\"1 N\", 0, 0]")),
              HasSubstr("lead the same place"));
  EXPECT_THAT(message(fix + link("pressure = \"1 Pa\"")), HasSubstr("not \"pressure\""));
  EXPECT_THAT(message(fix + link("at = [0, 0, 0]\ntorque = [\"1 N m\", 0, 0]")), HasSubstr("\"at\""));
  EXPECT_THAT(message(fix + link("force = [\"1 N\", 0, 0]", "stiff")),
              HasSubstr("\"averaging\" or \"rigid\""));
  EXPECT_THAT(
      message(fix + "[[load]]\nwhere = { sphere = { centre = [\"2 m\", 0, 0], radius = \"10 mm\" } }\n"
                    "link = \"rigid\"\nforce = [\"1 N\", 0, 0]\n"),
      HasSubstr("more than one element"));
}

}  // namespace
}  // namespace flexel::simulate
