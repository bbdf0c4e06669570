// Drag against the textbook: terminal speeds at several resolutions, turned bodies, a body too light to stop.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/drag.h"
#include "simulate/effects/gravity.h"
#include "simulate/result/options.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

constexpr double kCubeSide = 0.2, kCubeDensity = 100, kMedium = 50, kCoefficient = 1.3, kGravity = 9.81;

Body cube(int cells, const Vec3& origin = Vec3::Zero(), const std::string& name = "box") {
  testing::BoxOptions options;
  options.cells = {cells, cells, cells};
  options.spacing = Vec3::Constant(kCubeSide / cells);
  options.origin = origin;
  options.name = name;
  return testing::box_body(options);
}

Body single_voxel() {
  testing::CentreOptions options;
  options.voxels = {1, 1, 1};
  options.spacing = kCubeSide;
  return testing::centre_body(options);
}

Scene drag_scene(double time, double density = kCubeDensity) {
  Scene scene;
  scene.materials["gum"] = {"gum", 1e6, 0.25, density, "test"};
  scene.material = "gum";
  scene.run.time = time;
  scene.get<Drag>() = {kMedium, kCoefficient};
  return scene;
}

using testing::expect_books_close;
using testing::run_timed;
using testing::TimedCase;

void throw_at(Body& body, const Vec3& velocity) {
  Column column;
  column.components = 3;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    column.values.insert(column.values.end(), velocity.begin(), velocity.end());
  body.element_columns["velocity"] = column;
}

// v = sqrt(2 m g / (rho C A)).
TEST(Drag, AFallingCubeReachesTheTextbooksSpeedAtAnyResolution) {
  const double mass = kCubeDensity * kCubeSide * kCubeSide * kCubeSide;
  const double terminal = std::sqrt(2 * mass * kGravity / (kMedium * kCoefficient * kCubeSide * kCubeSide));
  for (const int cells : {2, 5}) {
    Body body = cube(cells);
    throw_at(body, Vec3(0, 0, -0.8 * terminal));
    Scene scene = drag_scene(6 * terminal / kGravity);
    scene.get<Gravity>().acceleration = Vec3(0, 0, -kGravity);
    scene.get<Damping>().entries.push_back({1e-4, std::nullopt, ""});
    const TimedCase made = run_timed(std::move(body), scene);
    EXPECT_NEAR(-made.history.column("momentum z").back() / mass, terminal, 1e-3 * terminal) << cells;
    EXPECT_NEAR(made.history.column("momentum x").back() / mass, 0, 1e-6 * terminal) << cells;
    EXPECT_GT(made.history.column("drag dissipated").back(), 0.5 * mass * terminal * terminal);
    expect_books_close(made.result);
  }
}

// Model `paper` as printed: v = v_t tanh(g t / v_t), v_t = sqrt(m g / (pi r^2 rho)).
TEST(Drag, AnElementOfModelPaperFallsAsPrinted) {
  const double mass = kCubeDensity * kCubeSide * kCubeSide * kCubeSide;
  const double terminal = std::sqrt(mass * kGravity / (pi * kCubeSide * kCubeSide / 4 * kMedium));
  Scene scene = drag_scene(8 * terminal / kGravity);
  scene.run.step = 1e-3 * terminal / kGravity;
  scene.get<Gravity>().acceleration = Vec3(0, 0, -kGravity);
  const TimedCase made = run_timed(single_voxel(), scene);
  const std::vector<double>& time = made.history.column("time");
  for (std::size_t i = 0; i < time.size(); ++i)
    ASSERT_NEAR(-made.history.column("momentum z")[i] / mass,
                terminal * std::tanh(kGravity * time[i] / terminal), 1e-3 * terminal);
  EXPECT_NEAR(-made.history.column("momentum z").back() / mass, terminal, 1e-5 * terminal);
  expect_books_close(made.result);
}

// Total of the forces on a body that moves as a whole.
Vec3 force_on(const Body& body, const Vec3& velocity, const Mat3& turn = Mat3::Identity()) {
  Problem problem{body, std::vector<Material>(body.parts.size(), {"gum", 1e6, 0.25, kCubeDensity, ""}),
                  std::vector<std::uint8_t>(body.cell_count(), 0)};
  problem.duration = 1;
  Drag drag = *Drag::make({kMedium, kCoefficient}, problem);
  State state;
  for (const Vec3& x : body.rest) {
    state.displacement.push_back(turn * x - x);
    state.velocity.push_back(velocity);
  }
  std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
  drag.add_forces(state, forces);
  Vec3 sum = Vec3::Zero();
  for (const Vec3& force : forces) sum += force;
  return sum;
}

TEST(Drag, TurnsWithTheBodyAndActsOnItsFrontOnly) {
  const double speed = 3, flat = 0.5 * kMedium * kCoefficient * kCubeSide * kCubeSide * speed * speed;
  const Body body = cube(3);
  const Vec3 along = force_on(body, Vec3(speed, 0, 0));
  EXPECT_LT((along - Vec3(-flat, 0, 0)).norm(), 1e-12 * flat);
  // on edge: two fronts at 45 degrees, each flat / 2 along its normal
  const Mat3 turn = Eigen::AngleAxisd(pi / 4, Vec3::UnitZ()).toRotationMatrix();
  const Vec3 edge = force_on(body, Vec3(speed, 0, 0), turn);
  EXPECT_LT((edge - Vec3(-flat / std::sqrt(2.0), 0, 0)).norm(), 1e-12 * flat);
  const Mat3 askew = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  EXPECT_LT((force_on(body, askew * Vec3(speed, 0, 0), askew) - askew * along).norm(), 1e-12 * flat);
}

TEST(Drag, FacesThatTouchAnotherPartAreNotExposed) {
  Body pair = cube(2, Vec3::Zero(), "one");
  append(pair, cube(3, Vec3(kCubeSide, 0, 0), "two"));
  const double speed = 3, flat = 0.5 * kMedium * kCoefficient * kCubeSide * kCubeSide * speed * speed;
  EXPECT_NEAR(force_on(pair, Vec3(speed, 0, 0)).x(), -flat, 0.03 * flat);
  EXPECT_NEAR(force_on(pair, Vec3(-speed, 0, 0)).x(), flat, 0.03 * flat);
  EXPECT_NEAR(force_on(pair, Vec3(0, speed, 0)).y(), -2 * flat, 1e-12 * flat);
}

TEST(Drag, ALightBodyInADenseMediumIsSlowedNotThrownBack) {
  Body body = cube(2);
  throw_at(body, Vec3(20, 0, 0));
  Scene scene = drag_scene(0.05, 0.01);  // lighter than the medium by 1e7
  scene.get<Drag>() = {1e5, 1};
  const TimedCase made = run_timed(body, scene);
  const std::vector<double>& momentum = made.history.column("momentum x");
  const std::vector<double>&kinetic = made.history.column("kinetic"),
        &elastic = made.history.column("elastic");
  for (std::size_t i = 1; i < momentum.size(); ++i) {
    ASSERT_LE(kinetic[i] + elastic[i], 1.001 * kinetic[0]);
    ASSERT_GE(momentum[i], -1e-3 * momentum[0]);
  }
  EXPECT_LT(momentum.back(), 1e-2 * momentum.front());
  EXPECT_LT(kinetic.back() + elastic.back(), 1e-3 * kinetic.front());
}

TEST(Drag, SameBitsForAnyNumberOfThreads) {
  Body body = cube(12);
  throw_at(body, Vec3(5, 4, 3));
  const Scene scene = drag_scene(2e-3);
  SimulateOptions alone, together;
  alone.threads = 1;
  together.threads = 2;
  const TimedCase one = run_timed(body, scene, alone), two = run_timed(body, scene, together);
  for (std::size_t e = 0; e < one.body.element_count(); ++e)
    ASSERT_EQ(one.body.position[e], two.body.position[e]);
}

TEST(Drag, IsReadFromTheSceneAndRefusedAtEquilibrium) {
  const Scene scene = parse_scene("[drag]\ndensity = \"1.2 kg/m3\"\ncoefficient = 0.5\n", "scene.toml");
  EXPECT_EQ(scene.get<Drag>().density, 1.2);
  EXPECT_EQ(scene.get<Drag>().coefficient, 0.5);
  EXPECT_THROW((void)parse_scene("[drag]\n", "s"), InputError);
  EXPECT_THROW((void)parse_scene("[drag]\ndensity = \"-1 kg/m3\"\n", "s"), InputError);
  Body body = cube(2);
  Scene still = drag_scene(1);
  still.run = {};
  Progress progress("test", Progress::Mode::quiet);
  EXPECT_THROW((void)simulate(body, still, {}, progress), InputError);
}

}  // namespace
}  // namespace flexel::simulate
