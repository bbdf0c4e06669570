// Gravity of sources and of every element on every other, against pairs one by one and Kepler's laws.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/error.h"
#include "simulate/effects/gravity.h"
#include "simulate/result/options.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/sanitized.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

PointMasses random_points(std::size_t count, double radius) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  PointMasses points;
  for (std::size_t i = 0; i < count; ++i) {
    points.position.emplace_back(uniform(engine), uniform(engine), uniform(engine));
    points.mass.push_back(0.5 + uniform(engine));
    points.radius.push_back(radius * (0.5 + uniform(engine)));
  }
  return points;
}

double energy_of(const PointMasses& points) {
  const Attraction attraction = attraction_by_pairs(points);
  double sum = 0;
  for (std::size_t i = 0; i < points.mass.size(); ++i) sum += 0.5 * points.mass[i] * attraction.potential[i];
  return sum;
}

TEST(GravitySum, IsThatOfThePairs) {
  const PointMasses points = random_points(77, 0.05);
  const Attraction attraction = attraction_by_pairs(points);
  for (std::size_t i = 0; i < 77; ++i) {
    Vec3 field = Vec3::Zero();
    double potential = 0, tide = 0;
    for (std::size_t j = 0; j < 77; ++j) {
      if (i == j) continue;
      const Vec3 d = points.position[j] - points.position[i];
      const double r = d.norm(), a = (points.radius[i] + points.radius[j]) / 2, m = points.mass[j];
      field += m / std::pow(std::max(r, a), 3) * d;
      tide += m / std::pow(std::max(r, a), 3);
      potential -= r >= a ? m / r : m * (3 - r * r / (a * a)) / (2 * a);
    }
    EXPECT_LT((attraction.field[i] - field).norm(), 1e-12 * field.norm());
    EXPECT_NEAR(attraction.potential[i], potential, -1e-12 * potential);
    EXPECT_NEAR(attraction.tide[i], tide, 1e-12 * tide);
  }
}

TEST(GravitySum, AttractsKeepsMomentumAndIsTheDerivativeOfItsEnergy) {
  PointMasses points = random_points(60, 0.2);  // many of them overlap
  const Attraction attraction = attraction_by_pairs(points);
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  double size = 0;
  for (std::size_t i = 0; i < points.mass.size(); ++i) {
    const Vec3 each = points.mass[i] * attraction.field[i];
    force += each;
    torque += points.position[i].cross(each);
    size += each.norm();
  }
  EXPECT_LT(force.norm(), 1e-14 * size);
  EXPECT_LT(torque.norm(), 1e-14 * size);
  const double step = 1e-5;
  for (std::size_t i = 0; i < points.mass.size(); i += 7)
    for (int axis = 0; axis < 3; ++axis) {
      PointMasses more = points, less = points;
      more.position[i][axis] += step;
      less.position[i][axis] -= step;
      const double slope = (energy_of(more) - energy_of(less)) / (2 * step);
      EXPECT_NEAR(points.mass[i] * attraction.field[i][axis], -slope, 1e-6 * size / 60);
    }
}

TEST(GravitySum, ElementsAtOnePlaceDoNoHarm) {
  PointMasses points = random_points(2, 0.1);
  points.position[1] = points.position[0];
  points.radius = {0.1, 0.1};
  const Attraction attraction = attraction_by_pairs(points);
  EXPECT_EQ(attraction.field[0], Vec3::Zero());
  EXPECT_DOUBLE_EQ(attraction.potential[0], -1.5 * points.mass[1] / 0.1);
}

// Single voxels of 1 kg along x, 1 m apart or more, that nothing connects.
Body voxels(const std::vector<int>& places) {
  testing::CentreOptions options;
  options.spacing = 0.1;
  options.voxels = {places.back() + 1, 1, 1};
  options.inside = [places](int i, int, int) {
    return std::find(places.begin(), places.end(), i) != places.end();
  };
  return testing::centre_body(options);
}

Body pieces_of_gum() {  // two blocks of 8 kg, 0.4 m apart
  testing::BoxOptions options;
  options.cells = {8, 2, 2};
  options.spacing = Vec3::Constant(0.1);
  options.fill = [](int i, int, int) { return i < 2 || i >= 6 ? 1.0 : 0.0; };
  return testing::box_body(options);
}

Scene gravity_scene(double time, double constant) {
  Scene scene;
  scene.materials["gum"] = {"gum", 1e5, 0.25, 1000, "test"};
  scene.material = "gum";
  scene.run.time = time;
  scene.run.method = TimeMethod::verlet;
  scene.get<Gravity>().constant = constant;
  return scene;
}

using testing::expect_books_close;
using testing::run_timed;
using testing::set_velocity;
using testing::TimedCase;

// Two masses m at distance d circle with omega^2 = 2 G m / d^3.
TEST(MutualGravity, TwoElementsCircleAHundredTimes) {
  Body body = voxels({0, 10});
  const double constant = 0.7, omega = std::sqrt(2 * constant), period = 2 * pi / omega;
  set_velocity(body, {Vec3(0, -omega / 2, 0), Vec3(0, omega / 2, 0)});
  Scene scene = gravity_scene(100 * period, constant);
  scene.get<Gravity>().mutual = true;
  Probe probe;
  probe.name = "second";
  probe.at = body.rest[1];
  scene.probes.push_back(probe);
  const TimedCase made = run_timed(body, scene);
  for (std::size_t i = 0; i < made.history.columns[0].size(); ++i) {
    const Vec3 way(0.5 + made.history.column("second x")[i], made.history.column("second y")[i], 0);
    ASSERT_NEAR(way.norm(), 0.5, 0.5e-3);
    ASSERT_LT(std::abs(made.history.column("momentum y")[i]), 1e-12);
  }
  const Vec3 arm = made.body.position[1] - made.body.position[0];
  const double turned = std::atan2(arm.y(), arm.x());  // past 100 turns
  EXPECT_NEAR(turned / (2 * pi * 100), 0, 1e-3);
  expect_books_close(made.result);
}

// An ellipse from its far end: back there after whole periods, and as near as a (1 - e) in between.
TEST(SourceGravity, AnElementFollowsKeplersEllipse) {
  Body body = voxels({0});
  const double constant = 2, mass = 3, e = 0.4, far = 1.4, a = far / (1 + e);
  const double period = 2 * pi * std::sqrt(a * a * a / (constant * mass));
  set_velocity(body, {Vec3(0, std::sqrt(constant * mass * (1 - e) / far), 0)});
  Scene scene = gravity_scene(5 * period, constant);
  scene.get<Gravity>().sources = {{body.rest[0] - Vec3(far, 0, 0), mass}};
  scene.run.step = period / 2000;
  Probe probe;
  probe.name = "it";
  probe.at = body.rest[0];
  scene.probes.push_back(probe);
  const TimedCase made = run_timed(body, scene);
  double nearest = far;
  for (std::size_t i = 0; i < made.history.columns[0].size(); ++i)
    nearest = std::min(nearest,
                       Vec3(far + made.history.column("it x")[i], made.history.column("it y")[i], 0).norm());
  EXPECT_NEAR(nearest, a * (1 - e), 1e-3 * a);
  EXPECT_LT((made.body.position[0] - made.body.rest[0]).norm(), 1e-2 * a);
  expect_books_close(made.result);
}

TEST(SourceGravity, OfTheEarthIsItsWeight) {
  const Body body = pieces_of_gum();
  Scene scene = gravity_scene(1e-3, Gravity::kNewton);
  scene.get<Gravity>().sources = {{Vec3(0, 0, -6371e3), 5.9722e24}};
  const TimedCase made = run_timed(body, scene);
  const double weight = made.result.mass * 6.6743e-11 * 5.9722e24 / (6371e3 * 6371e3);
  ASSERT_EQ(made.result.loads.size(), 1u);
  EXPECT_NEAR(made.result.loads[0].force.z(), -weight, 1e-6 * weight);
  EXPECT_NEAR(made.history.column("momentum z").back(), -weight * 1e-3, 1e-5 * weight * 1e-3);
}

// Both blocks fall towards each other; in between them nothing moves.
TEST(MutualGravity, BlocksMeetHalfwayWithoutMomentum) {
  Scene scene = gravity_scene(0.5, 0.02);
  scene.get<Gravity>().mutual = true;
  const TimedCase made = run_timed(pieces_of_gum(), scene);
  const double start = made.body.rest.back().x(), fallen = start - made.body.position.back().x();
  EXPECT_GT(fallen, 0.03);
  const double size = made.result.mass * fallen;
  for (const char* name : {"momentum x", "momentum y", "momentum z"})
    for (const double momentum : made.history.column(name)) ASSERT_LT(std::abs(momentum), 1e-13 * size);
  for (const char* name : {"angular momentum x", "angular momentum y", "angular momentum z"})
    for (const double momentum : made.history.column(name)) ASSERT_LT(std::abs(momentum), 1e-12 * size);
  expect_books_close(made.result);
}

// Over 2,000 elements: by the tree.
TEST(MutualGravity, LargeBlocksFallByTheTree) {
  testing::BoxOptions options;
  options.cells = {30, 10, 10};
  options.spacing = Vec3::Constant(0.1);
  options.fill = [](int i, int, int) { return i < 10 || i >= 20 ? 1.0 : 0.0; };
  const double time = less_if_sanitized(0.4, 0.04, "a tenth of the time");
  Scene scene = gravity_scene(time, 0.004);
  scene.get<Gravity>().mutual = true;
  const TimedCase made = run_timed(testing::box_body(options), scene);
  ASSERT_GT(made.body.element_count(), 2000u);
  EXPECT_THAT(made.result.shares[1].why, HasSubstr("by a tree"));
  // 1 t each, centres 2 m apart: they draw each other with 1 N per kg or so
  const std::vector<double>& kinetic = made.history.column("kinetic");
  EXPECT_GT(kinetic.back(), 50 * std::pow(time / 0.4, 2));
  for (const char* name : {"momentum x", "momentum y", "momentum z"})
    EXPECT_LT(std::abs(made.history.column(name).back()), 1e-10 * std::sqrt(2 * 2000 * kinetic.back()));
  expect_books_close(made.result);
  for (const auto& [name, joules] : made.result.timed->books)
    if (name == "worst_residual") {
      EXPECT_LT(joules, 0.02 * kinetic.back());
    }
}

TEST(MutualGravity, SameBitsForAnyNumberOfThreads) {
  Scene scene = gravity_scene(0.1, 0.02);
  scene.get<Gravity>().mutual = true;
  scene.get<Gravity>().sources = {{Vec3(1, 2, 3), 50}};
  SimulateOptions alone, together;
  alone.threads = 1;
  together.threads = 2;
  const TimedCase one = run_timed(pieces_of_gum(), scene, alone),
                  two = run_timed(pieces_of_gum(), scene, together);
  for (std::size_t e = 0; e < one.body.element_count(); ++e)
    ASSERT_EQ(one.body.position[e], two.body.position[e]);
  EXPECT_NE(one.body.position[0], one.body.rest[0]);
}

TEST(GravityScene, ReadsSourcesAndConstants) {
  const Scene scene = parse_scene(
      "[gravity]\nmutual = true\nconstant = \"2 N m2/kg2\"\n"
      "source = [{ at = [0, 0, \"-6371 km\"], mass = \"5.97e24 kg\" }, { at = [0, 0, 0], mass = \"2 t\" }]\n"
      "[run]\ntime = \"1 s\"\n",
      "scene.toml");
  const Gravity::Parameters& gravity = scene.get<Gravity>();
  EXPECT_TRUE(gravity.mutual);
  EXPECT_EQ(gravity.constant, 2);
  ASSERT_EQ(gravity.sources.size(), 2u);
  EXPECT_EQ(gravity.sources[0].at, Vec3(0, 0, -6371e3));
  EXPECT_EQ(gravity.sources[1].mass, 2000);
  EXPECT_EQ(parse_scene("[gravity]\nmutual = true\nconstant = \"6.674e-11 m3/kg/s2\"\n", "s")
                .get<Gravity>()
                .constant,
            6.674e-11);
}

TEST(GravityScene, RefusesWhatItCannotUse) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      (void)parse_scene(text, "scene.toml");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message("[gravity]\n"), HasSubstr("needs \"acceleration\""));
  EXPECT_THAT(message("[gravity]\nsorce = 1\n"), HasSubstr("did you mean \"source\""));
  EXPECT_THAT(message("[gravity]\nmutual = 1\n"), HasSubstr("needs to be true or false"));
  EXPECT_THAT(message("[gravity]\nmutual = true\nconstant = \"1 m/s2\"\n"),
              HasSubstr("gravitational constant"));
  EXPECT_THAT(message("[gravity]\nacceleration = [0, 0, 0]\nconstant = \"1 m3/kg/s2\"\n"),
              HasSubstr("give one of them"));
  EXPECT_THAT(message("[gravity]\nsource = { at = [0, 0, 0], mass = \"-1 kg\" }\n"), HasSubstr("above 0"));
  EXPECT_THAT(message("[gravity]\nsource = { at = [0, 0, 0] }\n"), HasSubstr("needs \"mass\""));
  Body body = pieces_of_gum();
  Scene scene = gravity_scene(1, 1);
  scene.run = {};
  scene.get<Gravity>().mutual = true;
  Progress progress("test", Progress::Mode::quiet);
  try {
    (void)simulate(body, scene, {}, progress);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("acts in timed runs only"));
  }
}

}  // namespace
}  // namespace flexel::simulate
