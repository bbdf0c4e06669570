// Timed runs against analytic answers: what the books, momenta, waves and swings of real bodies must show.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/plasticity.h"
#include "simulate/models/stability.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "simulate/stepping/stepper.h"
#include "simulate/time/energy_history.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/study_beam.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using testing::box_body;
using testing::BoxOptions;
using testing::expect_books_close;
using testing::expect_momenta_kept;
using ::testing::HasSubstr;
using testing::kStudyGum;
using testing::small_box;
using testing::TimedCase;

Scene scene_made_of(const Material& material, double time) {
  Scene scene;
  scene.materials[material.name] = material;
  scene.material = material.name;
  scene.run.time = time;
  return scene;
}

InitialVelocity::Parameters thrown(const Vec3& velocity, const Vec3& spin = Vec3::Zero(),
                                   const Vec3& through = Vec3::Zero()) {
  StartingVelocity start;
  start.where = select_by_name("box");
  start.velocity = velocity;
  start.spin = spin;
  start.through = through;
  return {{start}};
}

TEST(Motion, FreeFall) {
  Scene scene = scene_made_of(kStudyGum, 0.2);
  scene.get<Gravity>().acceleration = Vec3(1, -2, -9.81);
  scene.get<Damping>().entries.push_back({1e-5, {}, ""});
  const TimedCase made = testing::run_timed(small_box(), scene);
  for (std::size_t e = 0; e < made.body.element_count(); ++e) {
    const Vec3 fallen = made.body.position[e] - made.body.rest[e];
    EXPECT_LT((fallen - 0.5 * 0.2 * 0.2 * Vec3(1, -2, -9.81)).norm(), 1e-3 * 0.2);
  }
  expect_books_close(made.result);
}

TEST(Motion, ThrownBodyKeepsItsMomenta) {
  BoxOptions options;
  options.cells = {6, 3, 2};
  options.spacing = Vec3::Constant(0.01);
  options.axes = (Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized())).toRotationMatrix();
  options.fill = [](int i, int j, int k) { return (i + j + k) % 3 == 0 ? 0.4 : 1.0; };
  Scene scene = scene_made_of(kStudyGum, 0.25);
  const Vec3 centre(0.02, 0.01, 0.01);
  scene.get<InitialVelocity>() = thrown(Vec3(1, 0.5, -2), 40 * Vec3(0.3, 0.2, 1).normalized(), centre);
  scene.get<Damping>().entries.push_back({2e-5, {}, ""});
  const TimedCase made = testing::run_timed(box_body(options), scene);
  expect_momenta_kept(made.history, 1e-9);
  // its spin stretches it, and the swing from that is damped
  EXPECT_GT(made.history.column("elastic").back(), 0);
  EXPECT_GT(made.history.column("damping dissipated").back(), 0);
  expect_books_close(made.result);
}

// A bar held at one end in its first longitudinal mode, nu = 0: frequency c / 4 L, damping ratio tau omega
// / 2.
struct Swing {
  double frequency = 0, decrement = 0;  // Hz; ln of the ratio of peaks one period apart
};

Swing swing_of_bar(Model model, double tau) {
  BoxOptions options;
  options.cells = {40, 1, 1};
  options.spacing = Vec3::Constant(0.01);
  Body body = box_body(options);
  const Material material{"bar", 1e6, model == Model::springs ? 0.25 : 0.0, 1000, "test"};
  const double length = 0.4, wave_speed = std::sqrt(1e6 / 1000);
  const double omega = wave_speed * pi / 2 / length;
  Scene scene = scene_made_of(material, 2.3 * 2 * pi / omega);
  scene.parts["box"].model = model == Model::springs ? "springs" : "cells";
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  if (tau > 0) scene.get<Damping>().entries.push_back({tau, {}, ""});
  Probe end;
  end.name = "end";
  end.where = select_by_name("x1");
  scene.probes.push_back(end);
  Column velocity;
  velocity.components = 3;
  for (const Vec3& at : body.rest)
    for (const double v : {1e-3 * std::sin(pi / 2 * at.x() / length), 0.0, 0.0}) velocity.values.push_back(v);
  body.element_columns["velocity"] = velocity;
  const TimedCase made = testing::run_timed(std::move(body), scene);
  expect_books_close(made.result);
  // the mode is clean, so that peaks and zeros of the end tell
  const std::vector<double>&time = made.history.column("time"), &u = made.history.column("end x");
  std::vector<double> zeros, peaks;
  for (std::size_t i = 1; i + 1 < u.size(); ++i) {
    if (u[i] > u[i - 1] && u[i] >= u[i + 1] && u[i] > 0) peaks.push_back(u[i]);
    if (u[i] > 0 && u[i + 1] <= 0)
      zeros.push_back(time[i] + (time[i + 1] - time[i]) * u[i] / (u[i] - u[i + 1]));
  }
  if (zeros.size() < 2 || peaks.size() < 2) return {};
  return {1 / (zeros[1] - zeros[0]), std::log(peaks[0] / peaks[1])};
}

TEST(Motion, BarSwingsAtItsFrequency) {
  const double expected = std::sqrt(1e6 / 1000) / 4 / 0.4;
  EXPECT_NEAR(swing_of_bar(Model::cells, 0).frequency / expected, 1, 0.002);
}

// A damping time that explicit steps could not take: the same decrement, within momentum and books.
TEST(Motion, LongDampingDecaysAsItShould) {
  const double omega = std::sqrt(1e6 / 1000) * pi / 2 / 0.4;
  for (const double zeta : {0.1, 0.3})
    for (const Model model : {Model::cells, Model::springs})
      EXPECT_NEAR(
          swing_of_bar(model, 2 * zeta / omega).decrement / (2 * pi * zeta / std::sqrt(1 - zeta * zeta)), 1,
          0.02)
          << zeta;
}

TEST(Motion, LongDampingKeepsMomenta) {
  Scene scene = scene_made_of(kStudyGum, 0.02);
  scene.get<InitialVelocity>() = thrown(Vec3(1, 0.5, -2), Vec3(20, 10, 30), Vec3(0.01, 0.01, 0.01));
  scene.get<Damping>().entries.push_back({0.05, {}, ""});
  const TimedCase made = testing::run_timed(small_box(), scene);
  expect_momenta_kept(made.history, 1e-6);
  expect_books_close(made.result);
}

// In stages or stepped through, long damping leads to the same place, to first order in the step, also where the bar
// flows meanwhile. Explicit Euler is of first order too: two steps of it tell where it leads to.
TEST(Motion, LongDampingAgreesWithShortSteps) {
  const auto stretched = [](TimeMethod method, std::optional<double> step) {
    BoxOptions options;
    options.cells = {4, 1, 1};
    options.spacing = Vec3::Constant(0.005);
    Material material{"flowing", 1e9, 0.3, 1000, "test"};
    material.yield = 10e6;
    material.hardening = 100e6;
    Scene scene = scene_made_of(material, 2e-3);
    scene.run.method = method;
    scene.run.step = step;
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
    Load pull = make_push(select_by_name("x1"), Vec3(300, 0, 0));
    pull.course = {{0, 8e-4, 1.6e-3}, {0, 1, 0}};
    scene.get<Loads>().loads.push_back(pull);
    scene.get<Damping>().entries.push_back({4e-5, {}, ""});
    scene.get<Plasticity>().entries.emplace_back();
    const TimedCase made = testing::run_timed(box_body(options), scene);
    return made.body.position.back().x() - made.body.rest.back().x();
  };
  const double longer = stretched(TimeMethod::explicit_euler, 1e-7),
               shorter = stretched(TimeMethod::explicit_euler, 5e-8), stepped = 2 * shorter - longer;
  const auto error = [&](double step) {
    return std::abs(stretched(TimeMethod::symplectic_euler, step) / stepped - 1);
  };
  const double coarse = error(0.5e-6), fine = error(0.125e-6);
  EXPECT_GT(stepped, 5e-5);
  EXPECT_LT(error(2e-6), 2e-3);
  EXPECT_LT(coarse, 1e-3);
  EXPECT_LT(fine, 0.35 * coarse);
}

TEST(Motion, LogarithmicDecrement) {
  const double omega = std::sqrt(1e6 / 1000) * pi / 2 / 0.4, zeta = 0.03;
  const double expected = 2 * pi * zeta / std::sqrt(1 - zeta * zeta);
  for (const Model model : {Model::cells, Model::springs}) {
    const Swing swing = swing_of_bar(model, 2 * zeta / omega);
    EXPECT_NEAR(swing.decrement / expected, 1, 0.02);
  }
}

// A pulse of displacement that runs to the right: where its middle is after a while.
TEST(Motion, WaveSpeed) {
  BoxOptions options;
  options.cells = {200, 1, 1};
  options.spacing = Vec3::Constant(0.01);
  Body body = box_body(options);
  const double speed = std::sqrt(1e6 / 1000), width = 0.1, start = 0.5, time = 1.0 / speed;
  Column velocity;
  velocity.components = 3;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const double x = (body.rest[e].x() - start) / width;
    const double u = 1e-5 * std::exp(-x * x);
    body.position[e].x() += u;
    for (const double v : {speed * 2 * x / width * u, 0.0, 0.0}) velocity.values.push_back(v);
  }
  body.element_columns["velocity"] = velocity;
  const TimedCase made =
      testing::run_timed(std::move(body), scene_made_of({"bar", 1e6, 0, 1000, "test"}, time));
  double sum = 0, moment = 0;
  for (std::size_t e = 0; e < made.body.element_count(); ++e) {
    const double u = made.body.position[e].x() - made.body.rest[e].x();
    sum += u * u;
    moment += u * u * made.body.rest[e].x();
  }
  EXPECT_NEAR((moment / sum - start) / (speed * time), 1, 0.01);
  expect_books_close(made.result);
}

// The paper's beam struck sideways: its lowest frequencies, by CalculiX (reference/beam_ccx.py).
TEST(Motion, BeamSwingsAtItsFrequency) {
  struct Case {
    int axis;
    double frequency;  // Hz
  };
  for (const Case& each : {Case{2, 0.8897}, Case{1, 1.1960}}) {
    const int n = 4;
    BoxOptions options;
    options.cells = {4 * n, static_cast<int>(std::lround(1.4 * n)), n};
    options.spacing = Vec3(2.0 / options.cells[0], 0.7 / options.cells[1], 0.5 / options.cells[2]);
    Body body = box_body(options);
    Scene scene = scene_made_of(kStudyGum, 3.2 / each.frequency);
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
    Probe tip;
    tip.name = "tip";
    tip.where = select_by_name("x1");
    scene.probes.push_back(tip);
    Column velocity;
    velocity.components = 3;
    for (const Vec3& at : body.rest) {
      const double s = at.x() / 2;  // close to the first mode
      const Vec3 v = 1e-4 * s * s * (1.5 - 0.5 * s) * Vec3::Unit(each.axis);
      velocity.values.insert(velocity.values.end(), v.begin(), v.end());
    }
    body.element_columns["velocity"] = velocity;
    const TimedCase made = testing::run_timed(std::move(body), scene);
    expect_books_close(made.result);
    // amplitude of the tip at a frequency: the one with the largest is the beam's
    const std::vector<double>& time = made.history.column("time");
    const std::vector<double>& u = made.history.column(std::string("tip ") + "xyz"[each.axis]);
    const auto amplitude = [&](double frequency) {
      double cosine = 0, sine = 0;
      for (std::size_t i = 0; i < u.size(); ++i) {
        const double window = std::pow(std::sin(pi * time[i] / time.back()), 2);
        cosine += window * u[i] * std::cos(2 * pi * frequency * time[i]);
        sine += window * u[i] * std::sin(2 * pi * frequency * time[i]);
      }
      return std::hypot(cosine, sine);
    };
    double best = 0;
    for (double f = 0.8 * each.frequency; f < 1.2 * each.frequency; f += 0.001 * each.frequency)
      if (amplitude(f) > amplitude(best)) best = f;
    EXPECT_NEAR(best / each.frequency, 1, 0.02) << "axis " << each.axis;
  }
}

TEST(Motion, StepAboveTheBoundIsRefused) {
  Scene scene = scene_made_of(kStudyGum, 0.01);
  Body body = small_box();
  const Problem problem{body, {kStudyGum}, std::vector<std::uint8_t>(body.cell_count(), 0)};
  const double bound = stable_step(problem, {0});
  scene.run.step = 1.01 * bound;
  Progress progress("test", Progress::Mode::quiet);
  EXPECT_THROW((void)simulate(body, scene, {}, progress), InputError);
  scene.run.step = 0.99 * bound;
  EXPECT_NO_THROW((void)simulate(body, scene, {}, progress));
}

// A state that is folded at the start is told as such, not as a step that is too long.
TEST(Motion, FoldAtTheStartIsTold) {
  Body body = small_box();
  body.position[0].x() += 0.1;  // ten cells further
  Scene scene = scene_made_of(kStudyGum, 0.01);
  scene.run.step = 1e-6;
  Progress progress("test", Progress::Mode::quiet);
  EXPECT_THROW((void)simulate(body, scene, {}, progress), DivergedError);
}

TEST(Motion, FoldInTheLastStepIsTold) {
  Body body = small_box();
  const Problem problem{body, {kStudyGum}, std::vector<std::uint8_t>(body.cell_count(), 0)};
  const double step = 0.5 * stable_step(problem, {0});
  Column velocity;
  velocity.components = 3;
  velocity.values.assign(3 * body.element_count(), 0);
  velocity.values[0] = 0.1 / step;  // ten cells further
  body.element_columns["velocity"] = velocity;
  Progress progress("test", Progress::Mode::quiet);
  EXPECT_THROW((void)simulate(body, scene_made_of(kStudyGum, step), {}, progress), DivergedError);
}

TEST(Motion, ARunWhoseBooksFailStops) {
  Body body = small_box();
  for (Vec3& at : body.position) at *= 1.001;  // it swings
  Scene scene = scene_made_of(kStudyGum, 0.05);
  scene.run.method = TimeMethod::explicit_euler;  // gains energy
  scene.run.step = 3e-5;
  EXPECT_THAT([&] { (void)testing::run_timed(body, scene); },
              ::testing::ThrowsMessage<DivergedError>(HasSubstr("J in the books of energy have come from")));
}

TEST(Motion, TimeBelowAnyStepIsOneStep) {
  Body body = small_box();
  Progress progress("test", Progress::Mode::quiet);
  const SimulateResult result = simulate(body, scene_made_of(kStudyGum, 1e-15), {}, progress);
  EXPECT_EQ(result.timed->steps, 1u);
  EXPECT_EQ(result.timed->time, 1e-15);
}

// Something folds before the motion runs away, where steps are checked often.
TEST(Motion, RunawayTellsWhereAndWhy) {
  for (const auto& [model, what] :
       {std::pair("springs", "a cell near ("), std::pair("paper", "an element near (")}) {
    SCOPED_TRACE(model);
    Scene scene = scene_made_of(kStudyGum, 1);
    scene.parts["box"].model = model;
    scene.get<InitialVelocity>() = thrown(Vec3::Zero(), Vec3(0, 0, 30), Vec3(0.015, 0.01, 0.01));
    scene.run.method = TimeMethod::explicit_euler;
    Body body = std::string(model) == "paper" ? testing::centre_body({.voxels = {3, 2, 2}, .spacing = 0.01})
                                              : small_box();
    Progress progress("test", Progress::Mode::quiet);
    try {
      (void)simulate(body, scene, {}, progress);
      FAIL() << "stayed";
    } catch (const DivergedError& error) {
      EXPECT_THAT(error.what(), HasSubstr(what));
      EXPECT_THAT(error.what(), HasSubstr("\"explicit\" gains energy by itself"));
    }
    // the caller has the last state that was sound
    ASSERT_EQ(body.position.size(), body.element_count());
    for (const Vec3& at : body.position) EXPECT_TRUE(at.allFinite());
  }
}

TEST(Motion, EffectsOfTimeAreRefusedAtEquilibrium) {
  Scene scene = scene_made_of(kStudyGum, 1);
  scene.run.time.reset();
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  scene.get<Damping>().entries.push_back({1e-5, {}, ""});
  Body body = small_box();
  Progress progress("test", Progress::Mode::quiet);
  EXPECT_THROW((void)simulate(body, scene, {}, progress), InputError);
}

TEST(Motion, MovesTakeTheirCourseAndSupportsDoTheWork) {
  Scene scene = scene_made_of(kStudyGum, 0.1);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  Tie pull = make_move(select_by_name("x1"), Vec3(0.003, 0, 0));
  pull.course = {{0, 0.05, 0.1}, {0, 1, 1}};
  scene.get<Supports>().ties.push_back(pull);
  scene.get<Damping>().entries.push_back({2e-4, {}, ""});
  const TimedCase made = testing::run_timed(small_box(), scene);
  EXPECT_NEAR(made.body.position.back().x() - made.body.rest.back().x(), 0.003, 1e-12);
  const double stored = made.history.column("elastic").back();
  EXPECT_NEAR(made.history.column("supports work").back(),
              stored + made.history.column("damping dissipated").back(), 1e-3 * stored);
  expect_books_close(made.result);
}

// Verlet starts with half a kick, which is second order in the step; symplectic Euler's whole one is first
// order.
TEST(Motion, OrderOfTheMethods) {
  const auto error = [](TimeMethod method, double share) {
    Body body = small_box();
    const Problem problem{body, {kStudyGum}, std::vector<std::uint8_t>(body.cell_count(), 0)};
    const double longest = stable_step(problem, {0});
    Scene scene = scene_made_of(kStudyGum, 64 * longest);
    scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
    scene.run.method = method;
    scene.run.step = share * longest;
    const TimedCase made = testing::run_timed(std::move(body), scene);
    return std::abs(made.body.position[0].z() - made.body.rest[0].z() +
                    0.5 * 9.81 * std::pow(*scene.run.time, 2));
  };
  EXPECT_LT(error(TimeMethod::verlet, 0.5), 1e-12);
  EXPECT_NEAR(error(TimeMethod::symplectic_euler, 0.5) / error(TimeMethod::symplectic_euler, 0.25), 2, 0.05);
  EXPECT_NEAR(error(TimeMethod::explicit_euler, 0.5) / error(TimeMethod::explicit_euler, 0.25), 2, 0.05);
}

// Its books begin between two half kicks; without damping, with it, and with it in stages.
TEST(Motion, BooksOfVerletClose) {
  for (const double tau : {0.0, 2e-5, 1e-3}) {
    Scene scene = scene_made_of(kStudyGum, 0.01);
    scene.run.method = TimeMethod::verlet;
    scene.get<InitialVelocity>() = thrown(Vec3(0, 0, 1), Vec3(0, 0, 30), Vec3(0.015, 0.01, 0.01));
    scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
    if (tau > 0) scene.get<Damping>().entries.push_back({tau, {}, ""});
    expect_books_close(testing::run_timed(small_box(), scene).result);
  }
}

TEST(Motion, ExplicitEulerGainsEnergy) {
  Scene scene = scene_made_of(kStudyGum, 0.02);
  scene.get<InitialVelocity>() = thrown(Vec3::Zero(), Vec3(0, 0, 30), Vec3(0.015, 0.01, 0.01));
  scene.run.method = TimeMethod::explicit_euler;
  scene.run.step = 1e-6;
  const TimedCase made = testing::run_timed(small_box(), scene);
  EXPECT_GT(made.history.column("residual").back(), 0);
}

}  // namespace
}  // namespace flexel::simulate
