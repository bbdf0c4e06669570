// Implicit steps: the damping matrix against the kernel's damping, and whole runs against analytic answers.
#include "simulate/implicit/implicit_euler.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/drag.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/plasticity.h"
#include "simulate/implicit/damping_matrix.h"
#include "simulate/models/set_rest_shape.h"
#include "simulate/time/energy_history.h"
#include "tests/simulate/law_materials.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using std::numbers::pi;
using testing::box_body;
using testing::BoxOptions;
using testing::kCauchyGum;
using testing::small_box;
using testing::TimedCase;

// Sheared, squeezed, turned cells of partial fill on a turned lattice: C v is what the kernel brakes with.
TEST(DampingMatrix, IsTheKernelsDamping) {
  for (const auto& [model, material] : {std::pair{Model::cells, Material{"gum", 1e6, 0.25, 1000, "test"}},
                                        {Model::springs, Material{"gum", 1e6, 0.25, 1000, "test"}},
                                        {Model::cells, testing::mooney_rivlin_material()},
                                        {Model::cells, testing::arruda_boyce_material()},
                                        {Model::cells, testing::orthotropic_material()}}) {
    BoxOptions options;
    options.cells = {3, 2, 2};
    options.spacing = model == Model::springs ? Vec3(0.01, 0.01, 0.01) : Vec3(0.01, 0.012, 0.009);
    options.axes = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    options.fill = [](int i, int j, int k) { return (i + j + k) % 2 == 0 ? 0.3 : 1.0; };
    Body body = box_body(options);
    body.cell_columns["damping_change"] = {1, std::vector<double>(body.cell_count(), 0)};  // as edits do
    for (std::size_t c = 0; c < body.cell_count(); c += 3)
      body.cell_columns["damping_change"].values[c] = 1.5;
    const Problem problem = testing::problem_of(body, material, model);
    const KernelEffects plan{{3e-4}};
    Stepper stepper(problem, plan, true, "");
    State state = testing::at_rest(body);
    state.displacement = testing::random_displacements(body, 0.002, 1);
    state.velocity = testing::random_displacements(body, 1, 2);
    const std::vector<Vec3> velocity = state.velocity;
    const StiffnessPattern pattern =
        stiffness_pattern(body, active_cells(problem), connection_rows({}, body.element_count()));
    BlockMatrix matrix = pattern.matrix;
    set_damping(problem, pattern.stencil, PaperModel(problem), plan.damping, state.displacement, matrix);
    std::vector<Vec3> pulled(body.element_count());
    multiply(matrix, velocity, pulled);
    (void)stepper.advance(state, {}, {0, 0, false});
    double largest = 0;
    for (const Vec3& force : stepper.damping_force()) largest = std::max(largest, force.norm());
    EXPECT_GT(largest, 0);
    for (std::size_t e = 0; e < pulled.size(); ++e)
      EXPECT_LT((pulled[e] + stepper.damping_force()[e]).norm(), 1e-11 * largest) << e;
  }
}

// Cells whose rest shape is another than the lattice's, in volume too, and springs that are broken.
TEST(DampingMatrix, IsTheKernelsDampingOfOtherRestShapes) {
  for (const Model model : {Model::cells, Model::springs}) {
    BoxOptions options;
    options.cells = {3, 2, 2};
    Body body = box_body(options);
    const Problem problem = testing::problem_of(body, Material{"gum", 1e6, 0.25, 1000, "test"}, model);
    renormalise_all(body, problem, testing::random_displacements(body, 0.05, 3));
    if (model == Model::springs) {
      body.cell_columns["broken_springs"] = {1, std::vector<double>(body.cell_count(), 0)};
      body.cell_columns["broken_springs"].values[4] = 0b1011;
    }
    KernelEffects plan{{3e-4}};
    plan.rest_shapes = true;
    plan.broken_springs = model == Model::springs;
    Stepper stepper(problem, plan, true, "");
    stepper.read_memory(body.cell_columns);
    State state = testing::at_rest(body);
    state.displacement = testing::random_displacements(body, 0.05, 1);
    state.velocity = testing::random_displacements(body, 1, 2);
    const std::vector<Vec3> velocity = state.velocity;
    const StiffnessPattern pattern =
        stiffness_pattern(body, active_cells(problem), connection_rows({}, body.element_count()));
    BlockMatrix matrix = pattern.matrix;
    set_damping(problem, pattern.stencil, PaperModel(problem), plan.damping, state.displacement, matrix);
    std::vector<Vec3> pulled(body.element_count());
    multiply(matrix, velocity, pulled);
    (void)stepper.advance(state, {}, {0, 0, false});
    double largest = 0, missed = 0;
    for (const Vec3& force : stepper.damping_force()) largest = std::max(largest, force.norm());
    for (std::size_t e = 0; e < pulled.size(); ++e)
      missed = std::max(missed, (pulled[e] + stepper.damping_force()[e]).norm());
    EXPECT_GT(largest, 0);
    EXPECT_LT(missed, 1e-11 * largest);
  }
}

// Bears steps of so many seconds, or a share of whatever is asked; settles or does not; has an energy.
struct Bearing : Effect {
  static constexpr const char* name = "bearing";
  double longest = std::numeric_limits<double>::infinity(), share = 1, joules = 0;
  bool settled = true;
  [[nodiscard]] std::string why() const override { return "a test"; }
  [[nodiscard]] double energy(const State&) override { return joules; }
  [[nodiscard]] StepBearing begin_implicit_step(const State&, const State&, double step) override {
    return {std::min(share, longest / step), false};
  }
  [[nodiscard]] bool settles(const State&) override { return settled; }
};

ImplicitStep advance(const Bearing& bearing) {
  const Body body = small_box();
  const Problem problem = testing::problem_of(body, kCauchyGum);
  const std::vector<double> mass(body.element_count(), 1);
  std::vector<ActiveEffect> effects;
  effects.push_back(activate(Bearing(bearing)));
  const KernelEffects plan{{0}};
  ImplicitEuler euler(problem, effects, plan, mass, 1e-8);
  State state = testing::at_rest(body);
  state.time = 0;
  const ImplicitStep told = euler.advance(state, 1, 1, [](const std::string&) {});
  EXPECT_EQ(*state.time, told.step);
  return told;
}

TEST(ImplicitEuler, GoesAsFarAsEffectsBear) {
  EXPECT_EQ(advance({}).step, 1);
  Bearing eighth;
  eighth.longest = 0.125;
  EXPECT_NEAR(advance(eighth).step, 0.125, 1e-12);
  Bearing none;
  none.share = 0.5;  // of whatever is asked
  EXPECT_EQ(advance(none).step, 0);
  EXPECT_NE(advance(none).trouble, "");
}

// Each try is at half of what the last one was at, not of what it was asked for: 1/8 ... 1/1024.
TEST(ImplicitEuler, HalvesTheStepThatFailed) {
  Bearing eighth;
  eighth.longest = 0.125;
  eighth.settled = false;
  const ImplicitStep told = advance(eighth);
  EXPECT_EQ(told.step, 0);
  EXPECT_EQ(told.failures, 8);
}

// Without forces Newton's method has nothing to do there.
TEST(ImplicitEuler, DoesNotEndWhereTheEnergyIsInfinite) {
  Bearing nowhere;
  nowhere.joules = std::numeric_limits<double>::infinity();
  const ImplicitStep told = advance(nowhere);
  EXPECT_EQ(told.step, 0);
  EXPECT_NE(told.trouble, "");
}

// Nothing is larger than what is no number: every comparison with it has to fail.
TEST(EnergyHistory, RefusesEnergiesThatAreNoNumbers) {
  const Body body = small_box();
  const Problem problem = testing::problem_of(body, kCauchyGum);
  const std::vector<double> mass(body.element_count(), 1);
  State state = testing::at_rest(body);
  state.time = 0;
  const std::vector<ActiveEffect> effects;
  const std::vector<ProbePoints> probes;
  EnergyHistory history(problem, effects, probes, mass, nullptr, {{0}});
  history.add_row_of(state, {});
  EXPECT_NO_THROW(history.refuse_broken_books(state));
  history.enter(state.displacement, {}, {}, std::nan(""));
  history.add_row_of(state, {});
  EXPECT_THROW(history.refuse_broken_books(state), DivergedError);
}

Scene implicit_scene(const Material& material, double time, double step) {
  Scene scene;
  scene.materials[material.name] = material;
  scene.material = material.name;
  scene.run.time = time;
  scene.run.step = step;
  scene.run.method = TimeMethod::implicit_euler;
  return scene;
}

const Material kSteel{"steel", 210e9, 0.3, 7850, "test"};

// A column of one cell, nu = 0, its top displaced and let go: implicit Euler of an oscillator of frequency
// omega and damping ratio zeta is known exactly.
//     (1 + 2 zeta omega dt + omega^2 dt^2) x+ = (2 + 2 zeta omega dt) x - x-
struct Decay {
  double end = 0, exact = 0, discrete = 0;
};

Decay decay(int steps, double zeta) {
  BoxOptions options;
  options.cells = {1, 1, 1};
  options.spacing = Vec3::Constant(0.01);
  Body body = box_body(options);
  const Material material{"bar", 1e6, 0, 1000, "test"};
  // one cell: stiffness E A / h over half of its mass
  const double omega = std::sqrt(1e6 * 0.01 / (0.5 * 1000 * 1e-6)), time = 1.3 / omega * 2 * pi;
  Scene scene = implicit_scene(material, time, time / steps);
  scene.run.tolerance = 1e-11;
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  if (zeta > 0) scene.get<Damping>().entries.push_back({2 * zeta / omega, {}, ""});
  const double start = 1e-9;
  for (Vec3& at : body.position)
    if (at.x() > 0.005) at.x() += start;
  const TimedCase made = testing::run_timed(std::move(body), scene);
  testing::expect_books_close(made.result);
  Decay result;
  result.end = (made.body.position.back().x() - made.body.rest.back().x()) / start;
  const double fast = omega * std::sqrt(1 - zeta * zeta), dt = time / steps;
  result.exact =
      std::exp(-zeta * omega * time) * (std::cos(fast * time) + zeta * omega / fast * std::sin(fast * time));
  double before = 1, now = 1;
  for (int n = 0; n < steps; ++n) {
    const double next =
        ((2 + 2 * zeta * omega * dt) * now - before) / (1 + 2 * zeta * omega * dt + std::pow(omega * dt, 2));
    before = now;
    now = next;
  }
  result.discrete = now;
  return result;
}

TEST(ImplicitEuler, OscillatorIsOfFirstOrder) {
  for (const double zeta : {0.0, 0.3}) {
    const Decay coarse = decay(400, zeta), fine = decay(800, zeta);
    EXPECT_NEAR(coarse.end, coarse.discrete, 1e-6);
    EXPECT_NEAR(fine.end, fine.discrete, 1e-6);
    EXPECT_NEAR((coarse.end - coarse.exact) / (fine.end - fine.exact), 2, 0.2) << zeta;
  }
}

TEST(ImplicitEuler, FreeFallIsOfFirstOrder) {
  // exactly dt^2 g n (n + 1) / 2
  Scene scene = implicit_scene(kCauchyGum, 0.2, 0.02);
  scene.get<Gravity>().acceleration = Vec3(1, -2, -9.81);
  scene.get<Damping>().entries.push_back({1e-3, {}, ""});
  const TimedCase made = testing::run_timed(small_box(), scene);
  for (std::size_t e = 0; e < made.body.element_count(); ++e)
    EXPECT_LT((made.body.position[e] - made.body.rest[e] - 0.02 * 0.02 * 55 * Vec3(1, -2, -9.81)).norm(),
              1e-9);
  testing::expect_books_close(made.result);
  EXPECT_LT(std::abs(made.history.column("numerical dissipated").back() -
                     0.5 * made.result.mass * 10 * std::pow(0.02, 2) * Vec3(1, -2, -9.81).squaredNorm()),
            1e-6 * made.history.column("kinetic").back());
}

// Thrown, spinning, damped: momentum is kept; what of the angular momentum is lost halves with the step, and
// so does the energy.
TEST(ImplicitEuler, MomentaOfAThrownBody) {
  const auto thrown = [](Model model, double step) {
    StartingVelocity start;
    start.where = select_by_name("box");
    start.velocity = Vec3(1, 0.5, -2);
    start.spin = Vec3(20, 10, 30);
    start.through = Vec3(0.015, 0.01, 0.01);
    Scene scene = implicit_scene(kCauchyGum, 0.005, step);
    scene.parts["box"].model = model == Model::springs ? "springs" : "cells";
    scene.get<InitialVelocity>() = {{start}};
    scene.get<Damping>().entries.push_back({1e-3, {}, ""});
    const TimedCase made = testing::run_timed(small_box(), scene);
    testing::expect_books_close(made.result);
    for (const char* axis : {"momentum x", "momentum y", "momentum z"})
      for (const double value : made.history.column(axis))
        EXPECT_NEAR(value, made.history.column(axis)[0],
                    1e-8 * std::abs(made.history.column("momentum z")[0]));
    double lost = 0, whole = 0;
    for (const char* axis : {"angular momentum x", "angular momentum y", "angular momentum z"}) {
      const std::vector<double>& values = made.history.column(axis);
      lost += std::pow(values.back() - values.front(), 2);
      whole += values.front() * values.front();
    }
    EXPECT_GE(made.history.column("numerical dissipated").back(), 0);
    return std::sqrt(lost / whole);
  };
  for (const Model model : {Model::cells, Model::springs}) {
    const double coarse = thrown(model, 2.5e-5), fine = thrown(model, 1.25e-5);
    EXPECT_LT(fine, 0.05);
    EXPECT_NEAR(coarse / fine, 2, 0.3);
  }
}

// Steps a thousand times the stable ones lead a steel beam under its load to equilibrium.
TEST(ImplicitEuler, StiffBodyComesToRestInEquilibrium) {
  BoxOptions options;
  options.cells = {8, 2, 2};
  options.spacing = Vec3::Constant(0.002);
  options.axes = Eigen::AngleAxisd(0.4, Vec3(0, 1, 0)).toRotationMatrix();
  const Body body = box_body(options);
  const double bound = stable_step(testing::problem_of(body, kSteel), {0});
  Scene scene = implicit_scene(kSteel, 1e5 * bound, 1e3 * bound);
  // elements, which equilibrium holds exactly too
  Selection held, led;
  held.kind = led.kind = Selection::Kind::half_space;
  held.point = body.rest.front() + 1e-6 * options.axes.col(0);
  held.normal = -options.axes.col(0);
  led.point = body.rest.back() - 1e-6 * options.axes.col(0);
  led.normal = options.axes.col(0);
  scene.get<Supports>().ties.push_back(make_fix(held));
  Tie push = make_move(led, Vec3(0, 1e-4, 0));
  push.course = {{0, 2e4 * bound}, {0, 1}};
  push.axes = {false, true, false};
  scene.get<Supports>().ties.push_back(push);
  scene.get<Loads>().loads.push_back(make_push(select_by_name("z1"), Vec3(0, 0, -300)));
  const TimedCase made = testing::run_timed(body, scene);
  testing::expect_books_close(made.result);
  scene.run.time.reset();
  scene.run.step.reset();
  for (Tie& tie : scene.get<Supports>().ties) tie.course = {};
  Body rest = body;
  Progress progress("test", Progress::Mode::quiet);
  const SimulateResult still = simulate(rest, scene, {}, progress);
  double largest = 0, apart = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    largest = std::max(largest, (rest.position[e] - rest.rest[e]).norm());
    apart = std::max(apart, (rest.position[e] - made.body.position[e]).norm());
  }
  EXPECT_LT(apart, 1e-4 * largest);
  ASSERT_EQ(still.reactions.size(), made.result.reactions.size());
  for (std::size_t r = 0; r < still.reactions.size(); ++r)
    EXPECT_LT((still.reactions[r].force - made.result.reactions[r].force).norm(),
              1e-3 * still.reactions[0].force.norm());
}

// A plate that falls through a medium comes to the speed at which drag carries its weight, also with steps
// that are long against the time that takes.
TEST(ImplicitEuler, DragIsTakenAtTheEndOfTheStep) {
  BoxOptions options;
  options.cells = {3, 3, 1};
  options.spacing = Vec3::Constant(0.01);
  Scene scene = implicit_scene({"light", 1e6, 0.25, 10, "test"}, 0.9, 0.1);
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  scene.get<Drag>().density = 1.2;
  const TimedCase made = testing::run_timed(box_body(options), scene);
  testing::expect_books_close(made.result);
  const double speed = std::sqrt(10 * 0.01 * 9.81 / (0.5 * 1.2));
  EXPECT_NEAR(-made.history.column("momentum z").back() / made.result.mass / speed, 1, 1e-3);
}

// Newton's iterations of all stretches of a run are told, and what acts in several of them is told once.
TEST(ImplicitEuler, EffortIsThatOfAllActs) {
  Scene scene = implicit_scene(kCauchyGum, 0.04, 0.002);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  const TimedCase whole = testing::run_timed(small_box(), scene);
  Event nothing;
  nothing.at = 0.02;
  nothing.name = "nothing";
  nothing.apply = [](EventContext&) { return std::string(); };
  scene.events.push_back(nothing);
  const TimedCase parted = testing::run_timed(small_box(), scene);
  EXPECT_GT(parted.result.newton_iterations, 0.8 * whole.result.newton_iterations);
  ASSERT_EQ(parted.result.shares.size(), whole.result.shares.size());
  for (std::size_t p = 0; p < whole.result.shares.size(); ++p)
    EXPECT_EQ(parted.result.shares[p].name, whole.result.shares[p].name);
}

TEST(ImplicitEuler, SameBitsForAnyNumberOfThreads) {
  BoxOptions options;
  options.cells = {16, 8, 8};
  options.spacing = Vec3::Constant(0.01);
  const auto positions = [&](int threads) {
    Scene scene = implicit_scene(kCauchyGum, 0.02, 0.005);
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
    scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
    scene.get<Damping>().entries.push_back({1e-3, {}, ""});
    SimulateOptions run;
    run.threads = threads;
    return testing::run_timed(box_body(options), scene, run).body.position;
  };
  EXPECT_EQ(positions(1), positions(4));
}

TEST(ImplicitEuler, RefusesWhatItDoesNotTake) {
  Scene scene = implicit_scene(kCauchyGum, 0.01, 1e-3);
  scene.get<Plasticity>().entries.emplace_back();
  scene.materials["gum"].yield = 1e4;
  Body body = small_box();
  Progress progress("test", Progress::Mode::quiet);
  EXPECT_THROW((void)simulate(body, scene, {}, progress), InputError);
}

// Squeezed flat: no step ends with every cell the right way round.
// A corner that is thrown through its cell: no step lets it, however short, and none makes it stand still.
TEST(ImplicitEuler, MatterThrownThroughItselfEndsTheRun) {
  Scene scene = implicit_scene({"gum", 1e6, 0.25, 1000, "test"}, 0.01, 5e-5);
  scene.parts["box"].model = "springs";
  BoxOptions options;
  options.cells = {3, 3, 3};
  options.spacing = Vec3::Constant(0.005);
  Body body = box_body(options);
  Column velocity{3, std::vector<double>(3 * body.element_count(), 0)};
  for (const std::size_t axis : {0u, 1u, 2u}) velocity.values[axis] = 100;
  body.element_columns["velocity"] = velocity;
  Progress progress("test", Progress::Mode::quiet);
  try {
    (void)simulate(body, scene, {}, progress);
    FAIL() << "stood still";
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("squeezed most near (0 mm, 0 mm, 0 mm), to J = 0.0"));
  }
}

TEST(ImplicitEuler, TellsWhereItEnds) {
  Scene scene = implicit_scene(kCauchyGum, 0.01, 1e-3);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("x0")));
  Tie squeeze = make_move(select_by_name("x1"), Vec3(-0.05, 0, 0));
  scene.get<Supports>().ties.push_back(squeeze);
  BoxOptions options;
  options.cells = {1, 1, 1};
  options.spacing = Vec3::Constant(0.01);
  Body body = box_body(options);
  Progress progress("test", Progress::Mode::quiet);
  try {
    (void)simulate(body, scene, {}, progress);
    ADD_FAILURE() << "a box pushed through itself should end the run";
  } catch (const DivergedError& error) {
    EXPECT_NE(std::string(error.what()).find("Newton"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flexel::simulate
