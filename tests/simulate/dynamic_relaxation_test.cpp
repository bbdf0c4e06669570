// Equilibrium with contact: known answers, what is left over, and what never comes to rest.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using testing::block;
using ::testing::HasSubstr;
using testing::kSide;
using testing::scene_of;

Scene still(double poisson) {
  Scene scene = scene_of(1);
  scene.run.time.reset();
  scene.materials["gum"].poisson = poisson;
  return scene;
}

SimulateResult settle(Body& body, const Scene& scene) {
  Progress progress("test", Progress::Mode::quiet);
  return simulate(body, scene, {}, progress);
}

Manipulator hold(const std::string& part, const Vec3& displacement = Vec3::Zero()) {
  Manipulator made;
  made.part = made.name = part;
  if (displacement != Vec3::Zero()) {
    made.path.time = {0, 1};
    made.path.displacement = {Vec3::Zero(), displacement};
    made.path.turn = {Vec3::Zero(), Vec3::Zero()};
  }
  return made;
}

// Two columns of two materials, one on the other, under a load: springs in series. Without Poisson's ratio
// each is E A / L; the contact yields by p h / (3 E) / stiffness, with E of both in series, and half a
// hundredth of a cell.
TEST(DynamicRelaxation, TwoStackedBlocksAreSpringsInSeries) {
  Body body = block("lower", {4, 4, 4}, Vec3::Zero());
  append(body, block("upper", {4, 4, 4}, Vec3(0, 0, 4 * kSide)));
  Scene scene = still(0);
  scene.materials["stiff"] = {"stiff", 2e6, 0, 1000, "test"};
  scene.parts["upper"].material = "stiff";
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("lower/z0")));
  const double area = 16 * kSide * kSide, force = 0.01 * 1e6 * area;
  scene.get<Loads>().loads.push_back(make_push(select_by_name("upper/z1"), Vec3(0, 0, -force)));
  scene.get<Contact>().self = false;
  scene.get<Contact>().friction = 0.5;
  Probe top;
  top.name = "top";
  top.where = select_by_name("upper/z1");
  scene.probes.push_back(top);
  const SimulateResult result = settle(body, scene);
  const double length = 4 * kSide, pressure = force / area;
  const double columns = pressure * length / 1e6 + pressure * length / 2e6;
  const double between = 0.5 * (pressure * kSide / 3e6 + pressure * kSide / 6e6) + 5e-3 * kSide;
  const double sunk = -result.probes[0].displacement.z();
  EXPECT_NEAR(sunk, columns + between, 0.02 * (columns + between));
  EXPECT_NEAR(result.reactions.at(0).force.z(), force, 1e-3 * force);
  EXPECT_LT(result.imbalance.norm(), 1e-3 * force);
  ASSERT_TRUE(result.settled);
  EXPECT_LE(result.settled->residual, 1e-5);
  EXPECT_GT(result.settled->steps, 100u);
  EXPECT_FALSE(result.timed);
  EXPECT_FALSE(body.element_columns.contains("velocity"));
}

// Of a couple no force is left to measure what is left over by.
TEST(DynamicRelaxation, ABarComesToRestUnderACouple) {
  for (const bool follower : {false, true}) {
    const auto turned = [&](bool contact) {
      Body body = block("bar", {6, 2, 2});
      Scene scene = still(0.3);
      scene.get<Supports>().ties.push_back(make_fix(select_by_name("bar/x0")));
      Load load = make_push(select_by_name("bar/x1"), Vec3::Zero());
      load.force.reset();
      load.torque = Vec3(0, -0.03, 0.02);
      load.follower = follower;
      scene.get<Loads>().loads.push_back(load);
      scene.get<Contact>().on = contact;
      const SimulateResult result = settle(body, scene);
      EXPECT_EQ(result.settled.has_value(), contact);
      if (result.settled) {
        EXPECT_LE(result.settled->residual, 1e-5);
        EXPECT_GT(result.settled->residual, 0);
      }
      return *result.loads.at(0).rotation;
    };
    const Vec3 at_once = turned(false), settled = turned(true);
    EXPECT_GT(at_once.norm(), 0.1);
    EXPECT_LT((settled - at_once).norm(), 5e-3 * at_once.norm()) << follower;
  }
}

// On a table that is held, so that what it carries is told, and tilted against both lattices.
TEST(DynamicRelaxation, ABlockAtRestWeighsOnWhatCarriesIt) {
  const Mat3 axes = testing::turn(0.4, Vec3(0, 0, 1));
  Body body = block("block", {3, 3, 3}, Vec3(0, 0, 0.0004), axes);
  append(body, block("table", {6, 6, 1}, Vec3(-0.025, -0.015, -kSide)));
  Scene scene = still(0.3);
  scene.get<RigidParts>().manipulators = {hold("table")};
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Contact>().friction = 0.5;
  const SimulateResult result = settle(body, scene);
  const double weight = 27e-6 * 1000 * 9.81, table = 36e-6 * 1000 * 9.81;
  EXPECT_NEAR(result.reactions.at(0).force.z() - table, weight, 1e-3 * weight);
  EXPECT_LT(std::abs(result.reactions[0].force.x()), 1e-3 * weight);
}

TEST(DynamicRelaxation, ABlockComesToRestOnAPlane) {
  Body body = block("block", {2, 2, 4}, Vec3(0, 0, 0.0002));
  Scene scene = still(0);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Contact>().planes = {ContactPlane{}};
  const SimulateResult result = settle(body, scene);
  // every layer carries what is above it: those above the lowest, whose rim has edges of contact too, shrink
  // by rho g L^2 / (2 E), in the mean of the cells' strains
  double top = 0, foot = 0, sunk = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const double moved = body.position[e].z() - body.rest[e].z();
    const auto at_cells = [](int i) { return i == 1 ? 0.5 : 0.25; };  // share of the two cells' corners
    const double share = at_cells(body.lattice_index[e][0]) * at_cells(body.lattice_index[e][1]);
    if (body.lattice_index[e][2] == 4) top += share * moved;
    if (body.lattice_index[e][2] == 1) foot += share * moved;
    if (body.lattice_index[e][2] == 0) sunk = moved;
  }
  const double shrunk = 1000 * 9.81 * 0.03 * 0.03 / 2e6;
  EXPECT_NEAR(foot - top, shrunk, 0.01 * shrunk);
  EXPECT_LT(sunk, -0.0002);  // through the gap, and into the plane by less than a hundredth of a cell
  EXPECT_GT(sunk, -0.0002 - 1e-2 * kSide);
  EXPECT_LE(result.settled->residual, 1e-5);
}

// A rigid plate, led as far as its path goes, presses as it does in a slow run in time.
TEST(DynamicRelaxation, ToolsTakeTheirPaths) {
  Body body = block("block", {3, 3, 4}, Vec3::Zero());
  append(body, block("plate", {5, 5, 1}, Vec3(-0.01, -0.01, 0.04)));
  Scene scene = still(0);
  scene.get<RigidParts>().manipulators = {hold("plate", Vec3(0, 0, -0.0008))};
  scene.get<Contact>().planes = {ContactPlane{}};
  const SimulateResult result = settle(body, scene);
  const double pressed = 1e6 * 9e-4 * (0.0008 - 2 * 5e-3 * kSide) / (0.04 + 2 * kSide / 3);  // N
  EXPECT_NEAR(result.reactions.at(0).force.z(), -pressed, 0.05 * pressed);
  EXPECT_LT((body.position.back() - body.rest.back() - Vec3(0, 0, -0.0008)).norm(), 1e-15);
}

// Parts that begin inside each other are out before rest is looked for, however long that was to take in
// time, and lie as they would had they begun side by side.
TEST(DynamicRelaxation, WhatBeginsInsideSomethingElseIsLetOutFirst) {
  const auto sunk = [](double inside, double parting, double tolerance) {
    Body body = block("lower", {2, 2, 2}, Vec3::Zero());
    append(body, block("upper", {2, 2, 2}, Vec3(0, 0, (2 - inside) * kSide)));
    Scene scene = still(0.3);
    scene.run.tolerance = tolerance;
    scene.run.tolerance_given = true;
    scene.get<Contact>().parting = parting;
    scene.get<Contact>().friction = 0.5;
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("lower/z0")));
    scene.get<Loads>().loads.push_back(make_push(select_by_name("upper/z1"), Vec3(0, 0, -2)));
    Probe top;
    top.name = "top";
    top.where = select_by_name("upper/z1");
    scene.probes.push_back(top);
    return -settle(body, scene).probes[0].displacement.z();
  };
  const double beside = sunk(0, 0, 1e-4);
  for (const double tolerance : {1e-2, 1e-4})
    for (const double parting : {0.02, 1.0})
      EXPECT_NEAR(sunk(0.5, parting, tolerance) + 0.5 * kSide, beside, 0.02 * kSide)
          << parting << " " << tolerance;
}

TEST(DynamicRelaxation, WhatNothingStopsIsToldOf) {
  Body body = block("block", {1, 1, 1}, Vec3::Zero());
  Scene scene = still(0.3);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  try {
    (void)settle(body, scene);
    FAIL() << "it falls for ever";
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("does not come to rest"));
    EXPECT_THAT(error.what(), HasSubstr("steps"));
  }
}

TEST(DynamicRelaxation, WhatActsInTimeIsRefused) {
  Body body = block("block", {2, 2, 2}, Vec3::Zero());
  Scene scene = still(0.3);
  testing::throw_part(scene, "block", Vec3(1, 0, 0));
  EXPECT_THROW((void)settle(body, scene), InputError);
  Scene live = still(0.3);
  live.get<RigidParts>().manipulators = {hold("block")};
  live.get<RigidParts>().manipulators[0].live = std::make_shared<LiveTool>();
  EXPECT_THROW((void)settle(body, live), InputError);
}

}  // namespace
}  // namespace flexel::simulate
