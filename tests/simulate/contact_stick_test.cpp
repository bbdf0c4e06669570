// What sticks: it holds until its traction is passed, pulls and shears; glue on a manipulator; bounces that
// lose what their damping says; memory that outlives an event.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "base/error.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "simulate/input/scene_selection.h"
#include "simulate/kernels/chunk_layout.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;
using ::testing::HasSubstr;

// Mean displacement of a part.
Vec3 way_of(const Body& body, std::size_t part) {
  Vec3 sum = Vec3::Zero();
  const std::uint32_t begin = body.parts[part].element_begin, end = body.parts[part].element_end;
  for (std::uint32_t e = begin; e < end; ++e) sum += body.position[e] - body.rest[e];
  return sum / (end - begin);
}

// A block of two cells cubed, 1000 kg/m3, on a plane that it sticks to, under an acceleration: the traction
// is 20 kg/m2 times it.
TimedCase hang(double stick, const Vec3& acceleration) {
  Scene scene = scene_of(0.03);
  scene.get<Contact>().sticky["gum"] = stick;
  scene.get<Contact>().planes.push_back(plane_at(0));
  scene.get<Contact>().damping = 3e-4;
  scene.get<Damping>().entries.push_back({3e-4, std::nullopt, ""});
  scene.get<Gravity>().acceleration = acceleration;
  scene.run.step = 2e-5;  // the same all along: the books notice changes of the step while something falls
  return testing::run_timed(block("a", {2, 2, 2}, Vec3::Zero()), scene);
}

TEST(ContactStick, HoldsUpToItsTractionAndLetsGoBeyond) {
  // 400 Pa, 800 at the first swing; slanting, 130 and at the rim 290 by what tips it
  for (const Vec3& holding : {Vec3(0, 0, 20), Vec3(4.8, 0, 6.4)}) {
    const TimedCase holds = hang(1000, holding);
    EXPECT_LT(way_of(holds.body, 0).norm(), 0.01 * kSide);
    expect_books_close(holds.result);
    const TimedCase torn = hang(1000, 70 * holding.normalized());  // 1400 Pa and more
    EXPECT_GT(way_of(torn.body, 0).norm(), kSide);
    expect_books_close(torn.result);
  }
}

// Along the surface it holds as much; mu is 0. (What tips the block draws its rim out by three times that.)
TEST(ContactStick, HoldsAlongTheSurface) {
  EXPECT_LT(way_of(hang(1000, Vec3(5, 0, 0)).body, 0).norm(), 0.02 * kSide);
  EXPECT_GT(way_of(hang(100, Vec3(20, 0, 0)).body, 0).norm(), 0.2 * kSide);
}

// Thrown against each other they stay together, and move as both.
TEST(ContactStick, WhatMeetsStaysTogetherWithItsMomentum) {
  Body body = block("a", {2, 2, 2}, Vec3::Zero());
  append(body, block("b", {2, 2, 2}, Vec3(0.001, 0.002, 0.021), turn(0.2, Vec3::UnitZ())));
  Scene scene = scene_of(0.03);
  throw_part(scene, "b", Vec3(0.1, 0, -0.5), Vec3(0, 0, 2));
  scene.get<Contact>().damping = 3e-4;
  scene.get<Damping>().entries.push_back({5e-5, std::nullopt, ""});
  for (const double stick : {0.0, 1e5}) {
    scene.get<Contact>().stick = stick;
    const TimedCase made = testing::run_timed(body, scene);
    expect_momenta_kept(made.history, 1e-9);
    const double apart = (way_of(made.body, 1) - way_of(made.body, 0)).z() + 0.001;
    if (stick > 0)
      EXPECT_LT(std::abs(apart), 0.05 * kSide);
    else
      EXPECT_GT(apart, 0.1 * kSide);
  }
}

TEST(ContactStick, AGluedManipulatorLiftsWhatItTouches) {
  for (const bool glue : {false, true}) {
    Body body = block("tool", {2, 2, 1}, Vec3(0, 0, 0.02));
    append(body, block("part", {2, 2, 2}, Vec3::Zero()));
    Scene scene = scene_of(0.1);
    Manipulator tool;
    tool.part = tool.name = "tool";
    tool.path.time = {0, 0.08};
    tool.path.displacement = {Vec3::Zero(), Vec3(0, 0, 0.01)};
    tool.path.turn = {Vec3::Zero(), Vec3(0, 0, 0.5)};
    scene.get<RigidParts>().manipulators.push_back(tool);
    scene.get<Damping>().entries.push_back({3e-4, std::nullopt, ""});
    scene.get<Contact>().damping = 3e-4;
    if (glue) scene.get<Contact>().glued = {"tool"};
    const TimedCase made = testing::run_timed(std::move(body), scene);
    const Vec3 way = way_of(made.body, 1);
    EXPECT_NEAR(way.z(), glue ? 0.01 : 0, 0.02 * kSide) << glue;
    // it turns with the tool: a corner goes by |2 sin(0.25)| of its distance from the axis
    const std::uint32_t corner = made.body.parts[1].element_begin;
    const Vec3 moved = made.body.position[corner] - made.body.rest[corner] - way;
    EXPECT_NEAR(moved.norm(), glue ? 2 * std::sin(0.25) * std::sqrt(2) * kSide : 0, 0.05 * kSide) << glue;
  }
}

TEST(ContactStick, ForcesBalanceWithTheirMoments) {
  Body body = block("a", {3, 3, 2}, Vec3::Zero());
  append(body, block("b", {2, 2, 2}, Vec3(0.006, 0.002, 0.02), turn(0.4, Vec3::UnitZ())));
  const Problem problem = problem_of(body);
  ContactSettings settings = all_parts(body);
  settings.stick.assign(2, 1e6);
  settings.damping = 1e-4;
  Contacts contacts(settings, problem);
  State state = starting_at_rest(body);
  contacts.finish_losses(state, 0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shake(-2e-5, 2e-5);
  for (Vec3& u : state.displacement) u = Vec3(shake(random), shake(random), shake(random));
  for (Vec3& v : state.velocity) v = 1e3 * Vec3(shake(random), shake(random), shake(random));
  for (std::uint32_t e = body.parts[1].element_begin; e < body.element_count(); ++e)
    state.displacement[e] += Vec3(1e-4, 2e-4, 3e-4);
  contacts.finish_losses(state, 1e-4);
  std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
  contacts.add_dissipative_forces(state, forces);
  Vec3 sum = Vec3::Zero(), moment = Vec3::Zero(), on_b = Vec3::Zero();
  double size = 0;
  for (std::size_t e = 0; e < forces.size(); ++e) {
    sum += forces[e];
    moment += (body.rest[e] + state.displacement[e]).cross(forces[e]);
    size += forces[e].norm();
    if (e >= body.parts[1].element_begin) on_b += forces[e];
  }
  EXPECT_LT(on_b.z(), -0.1 * size);  // back
  EXPECT_LT(sum.norm(), 1e-12 * size);
  EXPECT_LT(moment.norm(), 1e-12 * size);
}

// An edit makes the part stick: thrown off by a weight that acts upwards from then on, it stays.
TEST(ContactStick, AnEditMakesASelectionStickier) {
  const auto lifted = [](const std::string& stick) {
    Scene scene =
        parse_scene("[run]\ntime = \"30 ms\"\n[[event]]\nat = \"1 ms\"\ndo = \"edit\"\n" + stick, "s.toml");
    const Scene base = scene_of(0.03);
    scene.materials = base.materials;
    scene.material = base.material;
    scene.get<Contact>().on = true;
    scene.get<Bonds>().bond = false;
    scene.get<Contact>().planes.push_back(plane_at(0));
    scene.get<Contact>().damping = 3e-4;
    scene.get<Damping>().entries.push_back({3e-4, std::nullopt, ""});
    scene.get<Gravity>().acceleration = Vec3(0, 0, 20);
    const TimedCase made = testing::run_timed(block("a", {2, 2, 2}, Vec3::Zero()), scene);
    return way_of(made.body, 0).z();
  };
  EXPECT_LT(lifted("stick = \"5 kPa\"\n"), 0.01 * kSide);
  EXPECT_GT(lifted("density = 1.0001\n"), 0.5 * kSide);
  // only what is selected sticks
  EXPECT_GT(
      lifted(
          "stick = \"5 kPa\"\nwhere = { half_space = { point = [0, 0, \"15 mm\"], normal = [0, 0, 1] } }\n"),
      0.5 * kSide);
}

TEST(ContactStick, KeysAreReadAndRefused) {
  const Scene scene = parse_scene(
      "contact = true\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 kg/m3\"\nstick = "
      "\"2 kPa\"\n"
      "[[manipulator]]\npart = \"tool\"\nglue = true\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, "
      "1]\nstick = \"5 Pa\"\n",
      "s.toml");
  EXPECT_EQ(scene.get<Contact>().sticky.at("gum"), 2000);
  EXPECT_EQ(scene.get<Contact>().glued, std::vector<std::string>{"tool"});
  EXPECT_EQ(scene.get<Contact>().planes[0].stick, 5);
  EXPECT_EQ(parse_scene("[contact]\nstick = \"1 kPa\"\n", "s.toml").get<Contact>().stick, 1000);
  EXPECT_THROW((void)parse_scene("[contact]\nstick = 3\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("[contact]\nstick = \"-3 Pa\"\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("[[manipulator]]\npart = \"t\"\nglue = true\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("contact = true\n[[manipulator]]\npart = \"t\"\nglue = 1\n", "s.toml"),
               InputError);
}

// A force F(d) over the depth d and a dashpot of tau F'(d) that never pulls: the share of its speed that a
// mass leaves with, by small steps of their own.
double restitution(const std::function<double(double)>& force, double tau, double mass, double speed) {
  const double step = 2e-8, width = 1e-9;
  double depth = 0, velocity = speed;
  for (int n = 0; n < 1'000'000; ++n) {
    const double stiffness = (force(depth + width) - force(depth)) / width;
    const double push = std::max(force(depth) + tau * stiffness * velocity, 0.0);
    velocity -= step * push / mass;
    depth += step * velocity;
    if (depth <= 0) break;
  }
  return -velocity / speed;
}

TEST(ContactDamping, ABounceLosesWhatItsDampingSays) {
  const double mass = 0.008;
  const auto made_scene = [] {
    Scene scene = scene_of(0.002);
    scene.get<RigidParts>().parts = {"a"};
    scene.get<Contact>().planes.push_back(plane_at(0));
    scene.run.step = 5e-7;  // what the dashpot lags by is of first order in it
    return scene;
  };
  // the force over the depth, tabulated
  const Body still = block("a", {2, 2, 2}, Vec3::Zero());
  const Problem problem = problem_of(still);
  ContactSettings settings = all_parts(still);
  settings.planes = {plane_at(0)};
  Contacts contacts(settings, problem);
  State state = starting_at_rest(still);
  const double spacing = 1e-7;
  std::vector<double> table;
  for (int n = 0; n < 8000; ++n) {
    for (Vec3& u : state.displacement) u.z() = -spacing * n;
    std::vector<Vec3> forces(still.element_count(), Vec3::Zero());
    contacts.add_forces(state, forces);
    double sum = 0;
    for (const Vec3& force : forces) sum += force.z();
    table.push_back(sum);
  }
  const auto force = [&](double depth) {
    const double at = std::clamp(depth / spacing, 0.0, static_cast<double>(table.size()) - 2);
    const auto below = static_cast<std::size_t>(at);
    return table[below] + (at - static_cast<double>(below)) * (table[below + 1] - table[below]);
  };
  for (const double tau : {5e-5, 2e-4})
    for (const double speed : {0.3, 1.5}) {
      Scene scene = made_scene();
      scene.get<Contact>().damping = tau;
      throw_part(scene, "a", Vec3(0, 0, -speed));
      const TimedCase made = testing::run_timed(block("a", {2, 2, 2}, Vec3(0, 0, 0.0001)), scene);
      const double expected = restitution(force, tau, mass, speed);
      const double momentum = made.history.column("momentum z").back();
      EXPECT_NEAR(momentum / (mass * speed), expected, 0.01 * expected) << tau << " " << speed;
      expect_books_close(made.result);
    }
}

}  // namespace
}  // namespace flexel::simulate
