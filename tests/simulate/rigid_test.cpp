// Rigid parts and manipulators: free motion, collisions, paths, reactions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "simulate/matter/masses.h"
#include "simulate/result/result.h"
#include "simulate/rigid/path.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/contact_case.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using testing::block;
using testing::box_body;
using testing::expect_books_close;
using testing::expect_momenta_kept;
using testing::gum_scene;
using ::testing::HasSubstr;
using testing::kSide;
using testing::throw_part;
using testing::TimedCase;

Scene rigid_scene(double time, double poisson = 0.3) {
  Scene scene = gum_scene(poisson);
  scene.run.time = time;
  return scene;
}

Manipulator lead(const std::string& part, std::vector<double> time, std::vector<Vec3> displacement,
                 std::vector<Vec3> turn = {}) {
  Manipulator made;
  made.part = made.name = part;
  made.path.time = std::move(time);
  made.path.displacement = std::move(displacement);
  made.path.turn = turn.empty() ? std::vector<Vec3>(made.path.time.size(), Vec3::Zero()) : std::move(turn);
  return made;
}

// About the axis of middle inertia, which is unstable: it tumbles, and keeps its shape and momenta.
TEST(Rigid, ATumblingBlockKeepsItsShapeAndMomenta) {
  Scene scene = rigid_scene(0.5);
  scene.run.step = 2e-4;
  scene.get<RigidParts>().parts = {"box"};
  throw_part(scene, "box", Vec3(0.1, -0.2, 0.3), Vec3(0.2, 40, 0.1), Vec3(0.01, 0.02, 0.03));
  const TimedCase made = testing::run_timed(block("box", {2, 4, 6}), scene);
  expect_momenta_kept(made.history, 1e-12);
  const std::vector<double>& kinetic = made.history.column("kinetic");
  for (const double each : kinetic) EXPECT_NEAR(each, kinetic[0], 1e-12 * kinetic[0]);
  EXPECT_EQ(made.history.column("elastic").back(), 0);
  double largest = 0;
  bool turned = false;
  for (std::size_t e = 0; e < made.body.element_count(); ++e) {
    const double now = (made.body.position[e] - made.body.position[0]).norm();
    largest = std::max(largest, std::abs(now - (made.body.rest[e] - made.body.rest[0]).norm()));
    turned = turned || (made.body.position[e] - made.body.rest[e]).norm() > 0.02;
  }
  EXPECT_LT(largest, 1e-12);
  EXPECT_TRUE(turned);
}

// A hundred turns, about an axis of inertia and across all of them, with the step that the run chooses.
TEST(Rigid, AHundredTurnsKeepEnergyAndAngularMomentum) {
  for (const Vec3& spin : {Vec3(0, 0, 60), Vec3(0.3, 60, 0.2), Vec3(10, 30, 50)}) {
    Scene scene = rigid_scene(200 * pi / spin.norm());
    scene.get<RigidParts>().parts = {"box"};
    throw_part(scene, "box", Vec3(0.1, -0.2, 0.3), spin, Vec3(0.015, 0.02, 0.03));
    const TimedCase made = testing::run_timed(block("box", {3, 4, 6}), scene);
    expect_momenta_kept(made.history, 1e-10);
    const std::vector<double>& kinetic = made.history.column("kinetic");
    for (const double each : kinetic) ASSERT_NEAR(each, kinetic[0], 1e-10 * kinetic[0]);
    // 1/2 m v^2 + 1/2 w . J w of a solid block
    const Vec3 side = kSide * Vec3(3, 4, 6);
    const double mass = 1000 * side.prod(), squares = side.squaredNorm();
    const Vec3 inertia = mass / 12 * (Vec3::Constant(squares) - side.cwiseAbs2());
    EXPECT_NEAR(kinetic[0], 0.5 * (mass * 0.14 + inertia.dot(spin.cwiseAbs2())), 1e-9 * kinetic[0]);
  }
}

TEST(Rigid, FallsAsFreely) {
  Scene scene = rigid_scene(0.2);
  scene.get<RigidParts>().parts = {"box"};
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  const TimedCase made = testing::run_timed(block("box", {2, 2, 2}), scene);
  for (std::size_t e = 0; e < made.body.element_count(); ++e)
    EXPECT_NEAR(made.body.position[e].z() - made.body.rest[e].z(), -0.5 * 9.81 * 0.04, 1e-3 * 0.2);
  expect_books_close(made.result);
}

TEST(Rigid, CollidesWithASoftBlockAndKeepsTheMomenta) {
  Body body = block("soft", {3, 3, 3});
  append(body, block("hard", {2, 2, 2}, Vec3(0.004, 0.007, 0.031)));
  Scene scene = rigid_scene(0.02);
  scene.get<RigidParts>().parts = {"hard"};
  scene.get<Contact>().on = true;
  scene.get<Contact>().friction = 0.3;
  scene.get<Bonds>().bond = false;
  throw_part(scene, "hard", Vec3(0.1, 0, -0.5));
  const TimedCase made = testing::run_timed(std::move(body), scene);
  expect_momenta_kept(made.history, 1e-8);
  // light bodies, two and three cells thick (docs/reference/contact.md, the books)
  EXPECT_LT(testing::book(made.result, "worst_residual"), 0.05 * testing::book(made.result, "largest_term"));
  // the soft one has taken up some of it
  const Column& velocity = made.body.element_columns.at("velocity");
  double sum = 0;
  for (std::uint32_t e = 0; e < made.body.parts[0].element_end; ++e) sum += velocity.values[3 * e + 2];
  EXPECT_LT(sum / made.body.parts[0].element_end, -0.05);
}

// A rigid plate presses a block, without Poisson's ratio, onto a plane: F = E A strain, where each of the two
// contacts yields by p h / (3 E) and 0.5 % of h.
// What contact did to a part is what its momenta changed by: nothing else acts.
TEST(Rigid, TheHistoryHasWhatContactDoesToAFreePart) {
  Body body = block("soft", {3, 3, 3});
  append(body, block("hard", {2, 2, 2}, Vec3(0.006, 0.013, 0.031)));
  Scene scene = rigid_scene(0.02);
  scene.run.step = 4e-5;
  scene.run.history_every = 4e-5;
  scene.get<RigidParts>().parts = {"hard"};
  scene.get<Contact>().on = true;
  scene.get<Contact>().friction = 0.3;
  scene.get<Bonds>().bond = false;
  throw_part(scene, "hard", Vec3(0.1, 0, -0.5));
  const TimedCase made = testing::run_timed(std::move(body), scene);
  const std::vector<double> mass = lumped_masses(testing::problem_of(made.body));
  const Column& velocity = made.body.element_columns.at("velocity");
  const Part& hard = made.body.parts[1];
  Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero(), centre = Vec3::Zero();
  double whole = 0, lumped = 0;
  for (std::uint32_t e = hard.element_begin; e < hard.element_end; ++e) {
    whole += mass[e];
    centre += mass[e] * made.body.position[e];
  }
  centre /= whole;
  for (std::uint32_t e = hard.element_begin; e < hard.element_end; ++e) {
    const Vec3 p =
        mass[e] * Vec3(velocity.values[3 * e], velocity.values[3 * e + 1], velocity.values[3 * e + 2]);
    momentum += p;
    spin += (made.body.position[e] - centre).cross(p);
    lumped += mass[e] * (made.body.position[e] - centre).squaredNorm() * 2 / 3;
  }
  spin *= whole * 4 * kSide * kSide / 6 / lumped;  // the inertia of a cube, not of its corners
  const std::vector<double>& time = made.history.column("time");
  const auto impulse = [&](const std::string& what) {
    Vec3 sum = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<double>& of = made.history.column("hard contact " + what + " " + "xyz"[axis]);
      for (std::size_t row = 1; row < time.size(); ++row)
        sum[axis] += 0.5 * (of[row] + of[row - 1]) * (time[row] - time[row - 1]);
    }
    return sum;
  };
  const Vec3 change = momentum - whole * Vec3(0.1, 0, -0.5);
  EXPECT_GT(change.z(), 0.1 * whole);
  EXPECT_LT((impulse("force") - change).norm(), 0.01 * change.norm());
  EXPECT_GT(spin.norm(), 1e-3 * change.norm() * kSide);
  EXPECT_LT((impulse("torque") - spin).norm(), 0.02 * spin.norm());
}

TEST(Rigid, AManipulatorFollowsItsPathAndFeelsWhatItPresses) {
  Body body = block("block", {3, 3, 4});
  append(body, block("plate", {5, 5, 1}, Vec3(-0.01, -0.01, 0.04)));
  Scene scene = rigid_scene(0.4, 0);
  scene.get<RigidParts>().manipulators = {lead("plate", {0, 0.3}, {Vec3::Zero(), Vec3(0, 0, -0.0008)})};
  ContactPlane plane;
  scene.get<Contact>().on = true;
  scene.get<Contact>().planes = {plane};
  scene.get<Bonds>().bond = false;
  scene.get<Damping>().entries.push_back({2e-3, std::nullopt, ""});
  const TimedCase made = testing::run_timed(std::move(body), scene);
  const Part& plate = made.body.parts[1];
  for (std::uint32_t e = plate.element_begin; e < plate.element_end; ++e)
    EXPECT_LT((made.body.position[e] - made.body.rest[e] - Vec3(0, 0, -0.0008)).norm(), 1e-15);
  const double pressed = 1e6 * 9e-4 * (0.0008 - 2 * 5e-3 * kSide) / (0.04 + 2 * kSide / 3);  // N
  EXPECT_NEAR(made.history.column("plate force z").back(), -pressed, 0.05 * pressed);
  EXPECT_NEAR(made.result.reactions.back().force.z(), made.history.column("plate force z").back(),
              1e-3 * pressed);
  // the plate's centre is above that of the block
  EXPECT_NEAR(made.history.column("plate torque x").back(), 0, 0.1 * kSide * pressed);
}

TEST(Rigid, ReactionsOfAManipulatorAreThoseOfItsMotion) {
  Scene scene = rigid_scene(0.1);
  scene.run.step = 1e-4;
  // a turn at constant speed about an axis off its middle: centripetal force m omega^2 r
  const double omega = 20;
  Manipulator turned =
      lead("box", {0, 0.2}, {Vec3::Zero(), Vec3::Zero()}, {Vec3::Zero(), Vec3(0, 0, 0.2 * omega)});
  turned.path.about = Vec3(0.01, 0.01, 0.02) - Vec3(0.05, 0, 0);  // 5 cm from its middle
  scene.get<RigidParts>().manipulators = {turned};
  const TimedCase made = testing::run_timed(block("box", {2, 2, 4}), scene);
  const double mass = 1000 * 16e-6, expected = mass * omega * omega * 0.05;
  const double fx = made.history.column("box force x").back(), fy = made.history.column("box force y").back();
  EXPECT_NEAR(std::hypot(fx, fy), expected, 1e-3 * expected);
  // towards the axis
  const double angle = omega * made.history.column("time").back();
  EXPECT_NEAR(fx, -expected * std::cos(angle), 0.01 * expected);
  EXPECT_NEAR(made.history.column("box torque z").back(), 0, 1e-3 * expected * 0.05);
}

TEST(Rigid, PathsAreReadFromTables) {
  const ManipulatorPath path =
      read_path("time [ms], z [mm], rz [deg]\n0, 0, 0\n100, -5, 360\n\n200, -5, 720\n", "p.csv");
  const Pose half = path.at(0.05, Vec3::Zero());
  EXPECT_LT((half.translation - Vec3(0, 0, -0.0025)).norm(), 1e-15);
  EXPECT_LT((half.rotation - Vec3(-1, -1, 1).asDiagonal().toDenseMatrix()).norm(), 1e-12);
  EXPECT_LT((path.at(1, Vec3::Zero()).translation - Vec3(0, 0, -0.005)).norm(), 1e-15);
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      (void)read_path(text, "p.csv");
    } catch (const InputError& error) {
      return error.where() + ": " + error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("time,z [mm]\n"), HasSubstr("p.csv:1"));
  EXPECT_THAT(refusal("time [s], z [s]\n0, 1\n"), HasSubstr("p.csv:1"));
  EXPECT_THAT(refusal("time [s], z [mm]\n0, 1\n0, 2\n"), HasSubstr("p.csv:3"));
  EXPECT_THAT(refusal("time [s], z [mm]\n0\n"), HasSubstr("p.csv:2"));
  EXPECT_THAT(refusal("time [s], z [mm]\n0, one\n"), HasSubstr("\"one\""));
  EXPECT_THAT(refusal("time [s], z [mm]\n"), HasSubstr("no row"));
}

TEST(Rigid, ScenesSayWhatIsRigid) {
  const Scene scene = parse_scene(R"(
[parts.hard]
rigid = true
[[manipulator]]
part = "tool"
time = ["0 s", "1 s"]
displacement = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "-5 mm"]]
)",
                                  "s.toml");
  EXPECT_EQ(scene.get<RigidParts>().parts, std::vector<std::string>{"hard"});
  ASSERT_EQ(scene.get<RigidParts>().manipulators.size(), 1u);
  EXPECT_EQ(scene.get<RigidParts>().manipulators[0].path.displacement[1], Vec3(0, 0, -0.005));
  EXPECT_THROW((void)parse_scene("[parts.a]\nrigid = 1\n", "s.toml"), InputError);
  EXPECT_THROW((void)parse_scene("[[manipulator]]\npart = \"a\"\ntime = [\"0 s\"]\n", "s.toml"), InputError);
  Scene held = rigid_scene(0.1);
  held.get<RigidParts>().parts = {"box"};
  held.get<Supports>().ties.push_back(make_fix(select_by_name("box")));
  EXPECT_THROW((void)testing::run_timed(block("box", {2, 2, 2}), held), InputError);
  Scene unknown = rigid_scene(0.1);
  unknown.get<RigidParts>().parts = {"bix"};
  EXPECT_THROW((void)testing::run_timed(block("box", {2, 2, 2}), unknown), InputError);
}

}  // namespace
}  // namespace flexel::simulate
