// Contact in timed runs: momenta, bounces, walls that hold, friction that sticks and slides.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/input/scene_selection.h"
#include "simulate/matter/masses.h"
#include "simulate/result/options.h"
#include "tests/sanitized.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

Body two_blocks(double gap) {
  Body body = block("a", {4, 3, 3}, Vec3::Zero());
  append(body, block("b", {3, 3, 3}, Vec3(0.003, 0.002, 0.03 + gap), turn(0.2, Vec3(0.1, 0.2, 1))));
  return body;
}

TEST(Contact, ACollisionKeepsMomentaWithFrictionAndDamping) {
  for (const bool losses : {false, true}) {
    Scene scene = scene_of(0.02);
    throw_part(scene, "b", Vec3(0.3, -0.1, -1), Vec3(5, 2, 3));
    if (losses) {
      scene.get<Contact>().friction = 0.4;
      scene.get<Contact>().damping = 1e-4;
    }
    const TimedCase made = testing::run_timed(two_blocks(0.004), scene);
    expect_momenta_kept(made.history, 1e-9);
    EXPECT_GT(made.result.timed->steps, 30u);
    // a now has momentum: they met
    Vec3 momentum = Vec3::Zero();
    const Column& velocity = made.body.element_columns.at("velocity");
    for (std::uint32_t e = 0; e < made.body.parts[0].element_end; ++e)
      momentum += Vec3(velocity.values[3 * e], velocity.values[3 * e + 1], velocity.values[3 * e + 2]);
    EXPECT_LT(momentum.z() / made.body.parts[0].element_end, -0.2);
    expect_books_close(made.result);
    if (losses) {
      EXPECT_GT(made.history.column("contact friction dissipated").back(), 0);
    }
  }
}

TEST(Contact, SameBitsForAnyNumberOfThreads) {
  Scene scene = scene_of(0.005);
  throw_part(scene, "b", Vec3(0.3, -0.1, -2));
  scene.get<Contact>().friction = 0.4;
  std::vector<Vec3> first;
  for (const int threads : {1, 3}) {
    SimulateOptions options;
    options.threads = threads;
    const TimedCase made = testing::run_timed(two_blocks(0.001), scene, options);
    if (first.empty()) first = made.body.position;
    EXPECT_EQ(made.body.position, first);
  }
}

// Mean velocity of a part.
Vec3 mean_velocity(const Body& body, std::size_t part) {
  const Column& column = body.element_columns.at("velocity");
  Problem problem = problem_of(body);
  const std::vector<double> mass = lumped_masses(problem);
  Vec3 sum = Vec3::Zero();
  double total = 0;
  for (std::uint32_t e = body.parts[part].element_begin; e < body.parts[part].element_end; ++e) {
    sum += mass[e] * Vec3(column.values[3 * e], column.values[3 * e + 1], column.values[3 * e + 2]);
    total += mass[e];
  }
  return sum / total;
}

TimedCase bounce(int cells, double step = 0) {
  Scene scene = scene_of(0.012);
  if (step > 0) scene.run.step = step;
  throw_part(scene, "a", Vec3(0, 0, -0.3));
  scene.get<Contact>().planes.push_back(plane_at(-0.0005));
  return testing::run_timed(block("a", {3, 3, cells}, Vec3::Zero()), scene);
}

// It leaves with what its own vibrations do not keep. The contact gives back what it took but for what comes
// of steps that do not fall on the moment of touching, of second order in the step.
TEST(Contact, ABlockBouncesOffAPlane) {
  for (const int cells : {2, 6}) {
    const TimedCase made = bounce(cells);
    expect_books_close(made.result);
    const double largest = book(made.result, "largest_term");
    EXPECT_EQ(made.history.column("contact stored").back(), 0) << cells;
    EXPECT_LT(std::abs(made.history.column("numerical dissipated").back()), 2e-2 * largest) << cells;
    const TimedCase fine = bounce(cells, made.result.timed->step / 4);
    expect_books_close(fine.result);
    EXPECT_LT(std::abs(fine.history.column("numerical dissipated").back()), 1.5e-3 * largest) << cells;
  }
  const TimedCase made = bounce(6);
  EXPECT_GT(mean_velocity(made.body, 0).z(), 0.85 * 0.3);
  EXPECT_LT(mean_velocity(made.body, 0).z(), 1.0 * 0.3);
  const TimedCase fine = bounce(6, made.result.timed->step / 4);
  EXPECT_NEAR(mean_velocity(fine.body, 0).z(), mean_velocity(made.body, 0).z(), 0.01 * 0.3);
}

// The contacts stiffen what touches; the step gets by with half.
TEST(Contact, TheStepIsAtLeastHalfOfTheBareOne) {
  const Body body = block("a", {3, 3, 3}, Vec3::Zero());
  Scene scene = scene_of(1e-4);
  scene.get<Contact>().planes.push_back(plane_at(0));
  const double touching = testing::run_timed(body, scene).result.timed->step;
  scene.get<Contact>() = {};
  const double bare = testing::run_timed(body, scene).result.timed->step;
  EXPECT_GT(touching, 0.5 * bare);
}

// At a step of its own it would be through within two of them.
TEST(Contact, ABlockAt300MetresASecondDoesNotPassAWallOfTwoCells) {
  Body body = block("wall", {9, 9, 2}, Vec3::Zero());
  append(body, block("shot", {3, 3, 3}, Vec3(0.031, 0.0305, 0.028)));
  Scene scene = scene_of(4e-4);
  scene.materials["gum"] = {"gum", 2e11, 0.3, 7800, "steel"};
  Tie held;
  held.where = parse_where("[\"wall/x0\", \"wall/x1\"]", "test");
  held.name = "rim";
  scene.get<Supports>().ties.push_back(held);
  throw_part(scene, "shot", Vec3(0, 0, -300));
  const TimedCase made = testing::run_timed(std::move(body), scene);
  EXPECT_GT(mean_velocity(made.body, 1).z(), 0);
  for (std::uint32_t e = made.body.parts[1].element_begin; e < made.body.parts[1].element_end; ++e)
    EXPECT_GT(made.body.position[e].z(), 0);
}

// Two jaws of one part with a slot of one cell between them, one flung at the other.
TEST(Contact, APartTouchesItself) {
  BoxOptions options;
  options.name = "jaws";
  options.cells = {6, 2, 5};
  options.spacing = Vec3::Constant(kSide);
  options.fill = [](int i, int, int k) { return k == 2 && i > 0 ? 0.0 : 1.0; };
  const double low = 2 * kSide, high = 3 * kSide, out = 6 * kSide, deep = 2 * kSide;
  const Body body = within_block(box_body(options),
                                 {{kSide, 0, low},
                                  {out, 0, low},
                                  {out, deep, low},
                                  {kSide, deep, low},
                                  {kSide, 0, high},
                                  {out, 0, high},
                                  {out, deep, high},
                                  {kSide, deep, high}},
                                 {{0, 1, 2, 3}, {7, 6, 5, 4}});
  const auto least_gap = [&](bool self) {
    Scene scene = scene_of(0.012);
    scene.get<Contact>().self = self;
    StartingVelocity start;
    start.where = parse_where(
        "{ box = { min = [\"35 mm\", \"-1 mm\", \"29 mm\"], max = [\"1 m\", \"1 m\", \"1 m\"] } }", "test");
    start.velocity = Vec3(0, 0, -4.5);
    scene.get<InitialVelocity>().velocities.push_back(start);
    for (const double z : {low, high}) {
      Probe probe;
      probe.name = z == low ? "lower" : "upper";
      probe.at = Vec3(0.0575, 0.01, z);
      scene.probes.push_back(probe);
    }
    const TimedCase made = testing::run_timed(body, scene);
    double least = kSide;
    for (std::size_t row = 0; row < made.history.column("time").size(); ++row)
      least =
          std::min(least, kSide + made.history.column("upper z")[row] - made.history.column("lower z")[row]);
    return least;
  };
  EXPECT_GT(least_gap(true), -0.1 * kSide);
  EXPECT_LT(least_gap(false), -0.2 * kSide);
}

// A block on a plane at `angle`, under gravity, its lattice turned by `turned` about the plane's normal.
struct SlideOnSlope {
  TimedCase made;
  Vec3 down;          // unit, along the slope
  double speed, way;  // m/s, m, along it
};

SlideOnSlope slide(double angle, double friction, double time, double turned, double start = 0,
                   bool on_part = false) {
  const Mat3 tilt = turn(angle, Vec3::UnitY());
  const Mat3 axes = tilt * turn(turned, Vec3::UnitZ());
  Scene scene = scene_of(time);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Damping>().entries.push_back({2e-4, std::nullopt, ""});
  scene.get<Contact>().friction = friction;
  scene.get<Contact>().damping = 2e-4;
  Body body = block("block", {3, 3, 2}, Vec3::Zero(), axes);
  if (on_part) {
    append(body, block("ramp", {9, 5, 1}, tilt * Vec3(-0.02, -0.012, -kSide), tilt));
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("ramp")));
  } else {
    scene.get<Contact>().planes.push_back(plane_at(0, tilt.col(2)));
  }
  const Vec3 down = tilt.col(0);
  if (start != 0) throw_part(scene, "block", start * down);
  SlideOnSlope slope{testing::run_timed(std::move(body), scene), down, 0, 0};
  slope.speed = mean_velocity(slope.made.body, 0).dot(down);
  for (std::uint32_t e = 0; e < slope.made.body.parts[0].element_end; ++e)
    slope.way += (slope.made.body.position[e] - slope.made.body.rest[e]).dot(down) /
                 slope.made.body.parts[0].element_end;
  return slope;
}

TEST(ContactFriction, ABlockRestsBelowTheAngleOfFriction) {
  for (const double turned : {0.0, 0.4}) {
    const SlideOnSlope slope = slide(0.3, 0.4, 0.15, turned);  // tan 0.3 = 0.31
    EXPECT_LT(std::abs(slope.way), 0.01 * kSide) << turned;
    EXPECT_LT(std::abs(slope.speed), 1e-4) << turned;
  }
}

TEST(ContactFriction, ABlockSlidesAboveTheAngleOfFriction) {
  const std::vector<double> plane =
      less_if_sanitized<std::vector<double>>({0.0, 0.4, 0.9}, {0.4}, "one orientation of three");
  for (const bool on_part : {false, true})
    for (const double turned : on_part ? std::vector{0.4} : plane) {
      const double angle = 0.5, mu = 0.3, time = 0.1;
      const SlideOnSlope slope = slide(angle, mu, time, turned, 0, on_part);
      const double expected = 9.81 * (std::sin(angle) - mu * std::cos(angle));
      EXPECT_NEAR(slope.speed / time, expected, 0.02 * expected) << turned << on_part;
      EXPECT_NEAR(2 * slope.way / time / time, expected, 0.02 * expected) << turned << on_part;
      expect_books_close(slope.made.result);
    }
}

TEST(ContactFriction, ABlockThatSlidesStopsAfterItsDistance) {
  const double mu = 0.35, start = 0.12;
  for (const bool on_part : {false, true}) {
    const SlideOnSlope slope = slide(0, mu, 0.07, 0.3, start, on_part);
    const double expected = start * start / (2 * mu * 9.81);
    EXPECT_NEAR(slope.way, expected, 0.02 * expected) << on_part;
    EXPECT_NEAR(slope.speed, 0, 0.02 * start) << on_part;  // it trembles on its springs
    expect_books_close(slope.made.result);
  }
}

}  // namespace
}  // namespace flexel::simulate
