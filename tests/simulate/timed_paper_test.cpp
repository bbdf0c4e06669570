// Model `paper` in timed runs: damping as a derivative, the bound on the step, momenta, books, wave speed.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "base/error.h"
#include "base/math/eigenvalues.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/equilibrium/mechanics.h"
#include "simulate/matter/masses.h"
#include "tests/scratch.h"
#include "tests/simulate/study_beam.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::book;
using testing::centre_body;
using testing::CentreOptions;
using testing::set_velocity;

constexpr double kTimedYoung = 2e5, kTimedDensity = 900, kTimedSpacing = 0.02;

CentreOptions timed_notched_box() {
  CentreOptions options;
  options.voxels = {4, 3, 3};
  options.spacing = kTimedSpacing;
  options.axes =
      (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.4, Vec3::UnitY())).toRotationMatrix();
  options.inside = [](int i, int j, int k) { return !(i == 2 && j == 2 && k > 0); };
  return options;
}

Scene timed_scene(double time, double damping = 0) {
  Scene scene;
  scene.materials["gum"] = {"gum", kTimedYoung, 0.25, kTimedDensity, "test"};
  scene.material = "gum";
  scene.run.time = time;
  if (damping > 0) scene.get<Damping>().entries.push_back({damping, std::nullopt, ""});
  return scene;
}

SimulateResult run_with_books(Body& body, const Scene& scene, int threads = 0) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.threads = threads;
  const flexel::test::Scratch scratch;
  options.history = scratch.path("history.csv");
  return simulate(body, scene, options, progress);
}

Problem timed_problem(const Body& body) {
  return {body, {{"gum", kTimedYoung, 0.25, kTimedDensity, ""}}, {}, {Model::paper}, {HookeConstant::paper},
          {}};
}

State random_moving_state(std::size_t elements, double size, double speed) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  State state;
  for (std::size_t e = 0; e < elements; ++e) {
    state.displacement.push_back(size * Vec3(uniform(engine), uniform(engine), uniform(engine)));
    state.velocity.push_back(speed * Vec3(uniform(engine), uniform(engine), uniform(engine)));
  }
  return state;
}

Vec3 velocity_of(const Body& body, std::size_t e) {
  const std::vector<double>& values = body.element_columns.at("velocity").values;
  return Vec3(values[3 * e], values[3 * e + 1], values[3 * e + 2]);
}

// Momentum and angular momentum over the mass of an element.
std::pair<Vec3, Vec3> momenta_per_mass(const Body& body) {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    linear += velocity_of(body, e);
    angular += body.position[e].cross(velocity_of(body, e));
  }
  return {linear, angular};
}

// -dR/dv of R = 1/2 sum tau k (rate of length)^2.
TEST(TimedPaper, DampingIsTheDerivativeOfItsDissipation) {
  Body body = centre_body(timed_notched_box());
  Column& change = body.element_columns["damping_change"];  // as edits do
  for (std::size_t e = 0; e < body.element_count(); ++e) change.values.push_back(e % 3 == 0 ? 1.5 : 0);
  const PaperModel model(timed_problem(body));
  const State state = random_moving_state(body.element_count(), 0.2 * kTimedSpacing, 1.5);
  const double tau = 3e-4;
  const auto length_rates = [&](const State& at) {
    double sum = 0;
    const Connections connections = make_connections(timed_problem(body));
    const double dt = 1e-7;
    for (std::size_t c = 0; c < connections.size(); ++c) {
      const std::uint32_t a = connections.a[c], b = connections.b[c];
      const auto length = [&](double t) {
        return (body.rest[b] + at.displacement[b] + t * at.velocity[b] - body.rest[a] - at.displacement[a] -
                t * at.velocity[a])
            .norm();
      };
      const double rate = (length(dt) - length(-dt)) / (2 * dt);
      const double factor = 1 + 0.5 * (change.values[a] + change.values[b]);
      sum += 0.5 * tau * factor * connections.parts[0].kinds[connections.kind[c]].stiffness * rate * rate;
    }
    return sum;
  };
  std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
  model.add_damping(state, {tau}, forces);
  const double step = 1e-3, scale = tau * kTimedYoung * kTimedSpacing;
  for (std::uint32_t e = 0; e < body.element_count(); e += 4)
    for (int axis = 0; axis < 3; ++axis) {
      State more = state, less = state;
      more.velocity[e][axis] += step;
      less.velocity[e][axis] -= step;
      EXPECT_NEAR(forces[e][axis], -(length_rates(more) - length_rates(less)) / (2 * step), 1e-5 * scale);
    }
}

TEST(TimedPaper, FrequencyBoundIsAboveTheLargestAndCloseToIt) {
  const Body body = centre_body(timed_notched_box());
  for (const double size : {0.0, 0.1}) {
    State state = random_moving_state(body.element_count(), size * kTimedSpacing, 0);
    for (std::size_t e = 0; e < body.element_count(); ++e)
      state.displacement[e] += size * body.rest[e];  // stretched: tension adds stiffness
    Mechanics mechanics(timed_problem(body), {});
    mechanics.assemble(state);
    const BlockMatrix& blocks = mechanics.stiffness();
    const auto n = static_cast<Eigen::Index>(3 * body.element_count());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t row = 0; row < blocks.rows(); ++row)
      for (std::uint64_t q = blocks.row_offsets[row]; q < blocks.row_offsets[row + 1]; ++q)
        matrix.block<3, 3>(static_cast<Eigen::Index>(3 * row),
                           static_cast<Eigen::Index>(3 * blocks.columns[q])) = blocks.values[q];
    const std::vector<double> mass = lumped_masses(timed_problem(body));
    const double largest =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues()[n - 1] / mass[0];
    const double bound = mechanics.paper().frequencies(state, mass)[0];
    EXPECT_GE(bound, largest * (1 - 1e-12)) << size;
    EXPECT_LT(bound, 2 * largest) << size;
  }
}

TEST(TimedPaper, KeepsMomentumAndAngularMomentumDampedOrNot) {
  for (const double tau : {0.0, 2e-4}) {
    Body body = centre_body(timed_notched_box());
    const State start = random_moving_state(body.element_count(), 0.05 * kTimedSpacing, 0.2);
    for (std::size_t e = 0; e < body.element_count(); ++e) body.position[e] += start.displacement[e];
    set_velocity(body, start.velocity);
    const auto [linear, angular] = momenta_per_mass(body);
    Scene scene = timed_scene(0.05, tau);
    scene.run.step = 2e-5;  // a twentieth of the bound: the start is rough
    const SimulateResult result = run_with_books(body, scene);
    const auto [linear_after, angular_after] = momenta_per_mass(body);
    EXPECT_GT(result.timed->steps, 2000);
    EXPECT_LT((linear_after - linear).norm(), 1e-9 * linear.norm());
    EXPECT_LT((angular_after - angular).norm(), 1e-9 * angular.norm());
    EXPECT_LT(book(result, "worst_residual"), 1e-3 * book(result, "largest_term")) << tau;
    if (tau > 0)
      EXPECT_GT(book(result, "dissipated"), 0.3 * book(result, "largest_term"));
    else
      EXPECT_EQ(book(result, "dissipated"), 0);
  }
}

// A row of n elements swings freely as u_j = cos(pi p (j + 1/2) / n), with 2 sqrt(k / m) sin(pi p / 2n); for
// long waves that is the speed sqrt(E / rho) of a bar.
TEST(TimedPaper, AWaveRunsAlongARowAsInABar) {
  constexpr int n = 60, p = 2;
  CentreOptions options;
  options.voxels = {n, 1, 1};
  options.spacing = kTimedSpacing;
  const double speed = std::sqrt(kTimedYoung / kTimedDensity), quarter = n * kTimedSpacing / p / speed / 2;
  Body body = centre_body(options);
  const double size = 1e-5 * kTimedSpacing;
  for (int j = 0; j < n; ++j) body.position[j].x() += size * std::cos(M_PI * p * (j + 0.5) / n);
  Scene scene = timed_scene(0.8 * quarter);
  scene.run.method = TimeMethod::verlet;
  scene.run.step = 1e-2 * kTimedSpacing / speed;
  (void)run_with_books(body, scene);
  const double now = (body.position[0].x() - body.rest[0].x()) / (size * std::cos(M_PI * p * 0.5 / n));
  const double omega = std::acos(now) / (0.8 * quarter);
  const double exact = 2 * speed / kTimedSpacing * std::sin(M_PI * p / (2 * n));
  EXPECT_NEAR(omega, exact, 1e-5 * exact);
  EXPECT_NEAR(omega * n * kTimedSpacing / (M_PI * p), speed, 1e-3 * speed);
}

TEST(TimedPaper, DampingDecaysAsOfOneSwing) {
  CentreOptions options;
  options.voxels = {2, 1, 1};
  options.spacing = kTimedSpacing;
  Body body = centre_body(options);
  body.position[0].x() -= 1e-4 * kTimedSpacing;
  body.position[1].x() += 1e-4 * kTimedSpacing;
  const double omega = std::sqrt(2 * kTimedYoung / kTimedDensity) / kTimedSpacing, zeta = 0.1,
               tau = 2 * zeta / omega;
  const double damped = omega * std::sqrt(1 - zeta * zeta), period = 2 * M_PI / damped;
  Scene scene = timed_scene(3 * period, tau);
  scene.run.step = 1e-3 * period;
  scene.run.method = TimeMethod::verlet;
  (void)run_with_books(body, scene);
  const double left = (body.position[1].x() - body.rest[1].x()) / (1e-4 * kTimedSpacing);
  EXPECT_NEAR(left, std::exp(-zeta * omega * 3 * period), 2e-3);
}

TEST(TimedPaper, SameBitsForAnyNumberOfThreads) {
  CentreOptions options;
  options.voxels = {24, 16, 8};
  options.spacing = kTimedSpacing;
  Body one = centre_body(options), two = one;
  Scene scene = timed_scene(5e-3, 1e-4);
  scene.get<Supports>().ties.push_back(
      make_fix(testing::half_space(Vec3(kTimedSpacing, 0, 0), -Vec3::UnitX())));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -98.1);
  (void)run_with_books(one, scene, 1);
  (void)run_with_books(two, scene, 2);
  double moved = 0;
  for (std::size_t e = 0; e < one.element_count(); ++e) {
    ASSERT_EQ(one.position[e], two.position[e]);
    moved = std::max(moved, (one.position[e] - one.rest[e]).norm());
  }
  EXPECT_GT(moved, 1e-4 * kTimedSpacing);
}

TEST(TimedPaper, RefusesTooLongAStepAndMatterTurnedInsideOut) {
  Body body = centre_body(timed_notched_box());
  Scene scene = timed_scene(1);
  scene.run.step = 0.01;
  EXPECT_THROW((void)run_with_books(body, scene), InputError);
  std::vector<Vec3> velocity;
  for (const Vec3& x : body.rest) velocity.push_back(Vec3(-2e4 * x.x(), 0, 0));
  set_velocity(body, velocity);
  scene.run.step.reset();
  EXPECT_THROW((void)run_with_books(body, scene), DivergedError);
}

}  // namespace
}  // namespace flexel::simulate
