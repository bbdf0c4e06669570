// Plastic flow of model `cells`: against closed forms, its energies, its symmetries.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/input/hardening.h"
#include "simulate/scene/scene.h"
#include "tests/sanitized.h"
#include "tests/scratch.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::at_rest;
using testing::box_body;
using testing::box_of;
using testing::BoxOptions;
using testing::forces_of;
using ::testing::HasSubstr;
using testing::problem_of;
using testing::random_displacements;
using testing::refusal;

const Material kMetal{"metal", 1e9, 0.3, 1000, "test"};
constexpr double kYield = 2e6;

KernelEffects hardening_plan(double hardening, double damping = 0) {
  return {{damping}, {{kYield, hardening}}, {}};
}

// Pulled beyond yield and let go within a scene, slowly, over tens of its periods.
const char* const kYieldingBar = R"(
material = "metal"
[materials.metal]
young = "1 GPa"
poisson = 0.3
density = "1000 kg/m3"
yield = "2 MPa"
hardening = "50 MPa"
[plasticity]
[damping]
time = "2 us"
[[fix]]
where = "xmin"
axes = "x"
[[fix]]
where = "ymin"
axes = "y"
[[fix]]
where = "zmin"
axes = "z"
[[load]]
where = "xmax"
force = ["10 N", "0 N", "0 N"]
time = ["0 s", "1.4 ms", "1.8 ms", "2.6 ms"]
factor = [0, 1, 1, 0]
[[probe]]
name = "end"
where = "xmax"
[run]
time = "3 ms"
)";

TEST(Plasticity, BarKeepsItsSet) {
  for (const int n : less_if_sanitized<std::vector<int>>({1, 2, 3}, {2}, "one lattice of three")) {
    Body body = box_of({3 * n, n, n}, 2e-3 / n);
    const Scene scene = parse_scene(kYieldingBar, "bar.toml");
    SimulateOptions options;
    const flexel::test::Scratch scratch;
    options.history = scratch.path("plastic_bar.csv");
    Progress progress("test", Progress::Mode::quiet);
    const SimulateResult result = simulate(body, scene, options, progress);
    // Logarithmic strains, Kirchhoff stress t = P exp(e): t = yield + H ep, e = ep + t / E.
    const double nominal = 10 / 4e-6;
    double plastic = 0;
    for (int i = 0; i < 100; ++i) {
      const double t = kYield + 50e6 * plastic;
      plastic = (nominal * std::exp(plastic + t / 1e9) - kYield) / 50e6;
    }
    const double set = 6e-3 * std::expm1(plastic);
    EXPECT_NEAR(result.probes[0].displacement.x(), set, 0.02 * set) << n;
    EXPECT_LT(testing::book(result, "worst_residual"), 1e-3 * testing::book(result, "largest_term")) << n;
    for (const double strain : body.cell_columns.at("plastic_strain").values)
      EXPECT_NEAR(strain, plastic, 0.02 * plastic);
    // Let go, it has its set and no stress but that of its last swings.
    for (const double stress : body.cell_columns.at("cell_von_mises").values) EXPECT_LT(stress, 0.1 * kYield);
  }
}

// Model springs flows as the material does: the same closed form.
TEST(Plasticity, SpringsKeepTheirSet) {
  for (const int n : less_if_sanitized<std::vector<int>>({1, 2, 3}, {2}, "one lattice of three")) {
    Body body = box_of({3 * n, n, n}, 2e-3 / n);
    std::string text = std::string(kYieldingBar) + "[parts.box]\nmodel = \"springs\"\n";
    text.replace(text.find("poisson = 0.3"), 13, "poisson = 0.25");
    SimulateOptions options;
    const flexel::test::Scratch scratch;
    options.history = scratch.path("plastic_springs.csv");
    Progress progress("test", Progress::Mode::quiet);
    const SimulateResult result = simulate(body, parse_scene(text, "bar.toml"), options, progress);
    double plastic = 0;
    for (int i = 0; i < 100; ++i)
      plastic = (10 / 4e-6 * std::exp(plastic + (kYield + 50e6 * plastic) / 1e9) - kYield) / 50e6;
    const double set = 6e-3 * std::expm1(plastic);
    EXPECT_NEAR(result.probes[0].displacement.x(), set, 0.05 * set) << n;
    EXPECT_LT(testing::book(result, "worst_residual"), 5e-3 * testing::book(result, "largest_term")) << n;
    for (const double strain : body.cell_columns.at("spring_strain").values)
      EXPECT_NEAR(strain, plastic, 0.05 * plastic) << n;
  }
}

// The plastic strain at which a bar of kYieldingBar's yield stress and modulus that hardens by Voce's law bears `nominal` [Pa]
// of its first section; step by step along the law, for the strain comes back beyond the largest load.
double plastic_under(double nominal, const VoceHardening& voce) {
  for (double a = 0;; a += 1e-6) {
    const double stress = kYield + voce.saturation * (1 - std::exp(-voce.rate * a));
    if (stress >= nominal * std::exp(a + stress / 1e9)) return a;
  }
}

// What the scene has in place of its linear hardening: 3 MPa of the first section at most, at a strain of .2. Six times as
// slowly, for near its largest load a bar is soft, and so swings slowly; the load stays from 8.4 to 10.8 ms.
std::string hardening_by_voce(const std::string& more, const std::string& end = "18 ms") {
  std::string text = kYieldingBar;
  const auto put = [&](const std::string& old, const std::string& with) {
    text.replace(text.find(old), old.size(), with);
  };
  put("hardening = \"50 MPa\"\n", "strength = \"3 MPa\"\nuniform_elongation = 0.2\n");
  put("\"1.4 ms\", \"1.8 ms\", \"2.6 ms\"", "\"8.4 ms\", \"10.8 ms\", \"15.6 ms\"");
  put("time = \"3 ms\"", "time = \"" + end + "\"");
  return text + more;
}

TEST(Plasticity, BarsHardenByVocesLaw) {
  const VoceHardening voce = *voce_hardening(kYield, 3e6, 0.2, 1e9);
  const double plastic = plastic_under(10 / 4e-6, voce), set = 6e-3 * std::expm1(plastic);
  for (const bool springs :
       less_if_sanitized<std::vector<bool>>({false, true}, {false}, "one model of two")) {
    std::string text = hardening_by_voce(springs ? "[parts.box]\nmodel = \"springs\"\n" : "");
    if (springs) text.replace(text.find("poisson = 0.3"), 13, "poisson = 0.25");
    Body body = box_of({6, 2, 2}, 1e-3);
    SimulateOptions options;
    const flexel::test::Scratch scratch;
    options.history = scratch.path("voce_bar.csv");
    Progress progress("test", Progress::Mode::quiet);
    const SimulateResult result = simulate(body, parse_scene(text, "bar.toml"), options, progress);
    const double within = springs ? 0.05 : 0.02;
    EXPECT_NEAR(result.probes[0].displacement.x(), set, within * set) << springs;
    EXPECT_LT(testing::book(result, "worst_residual"), 5e-3 * testing::book(result, "largest_term"))
        << springs;
    for (const double strain : body.cell_columns.at(springs ? "spring_strain" : "plastic_strain").values)
      EXPECT_NEAR(strain, plastic, within * plastic) << springs;
  }
}

// A bar of cells bears its strength and no more, though its true stress rises beyond.
TEST(Plasticity, ABarThatHardensBearsItsStrength) {
  for (const double share : less_if_sanitized<std::vector<double>>({0.97, 1.03}, {1.03}, "one load of two")) {
    std::string text = hardening_by_voce("[fracture]\n", share < 1 ? "18 ms" : "10.7 ms");
    text.replace(text.find("\"10 N\""), 6, fmt::format("\"{} N\"", 12 * share));
    Body body = box_of({6, 2, 2}, 1e-3);
    Progress progress("test", Progress::Mode::quiet);
    (void)simulate(body, parse_scene(text, "bar.toml"), {}, progress);
    double broken = 0, most = 0;
    for (std::size_t c = 0; c < body.cell_count(); ++c) broken += body.broken.empty() ? 0 : body.broken[c];
    for (const double strain : body.cell_columns.at("plastic_strain").values) most = std::max(most, strain);
    if (share < 1) {
      EXPECT_EQ(broken, 0);
      EXPECT_LT(most, std::log(1.2));
      EXPECT_GT(most, 0.08);
    } else {
      EXPECT_GT(broken, 0);
    }
  }
}

// What cells remember travels in the body's columns.
TEST(Plasticity, GoesOnFromWhatTheBodyRemembers) {
  const Body body = box_of({5, 3, 3});
  for (const Model model : {Model::cells, Model::springs}) {
    const Problem problem = problem_of(body, kMetal, model);
    KernelEffects plan = hardening_plan(1e7);
    plan.fracture = {{1e12, 0.3}};
    Stepper one(problem, plan, false), two(problem, plan, false), fresh(problem, plan, false);
    State state = at_rest(body);
    state.displacement = random_displacements(body, 1e-4, 11);
    (void)forces_of(one, state);
    Columns columns;
    one.write_memory(body.cell_count(), columns);
    EXPECT_TRUE(columns.contains(model == Model::cells ? "plastic_flow" : "spring_flow"));
    two.read_memory(columns);
    for (Vec3& u : state.displacement) u *= 0.99;
    const std::vector<Vec3> force = forces_of(one, state);
    EXPECT_EQ(force, forces_of(two, state));
    EXPECT_NE(force, forces_of(fresh, state));
  }
}

// Cross-sections of a beam of n cells are turned, and turned back until no moment is left.
double residual_curvature(int n, double curvature) {
  const double h = 1e-3;
  const Body body = box_of({2, n, 1}, h);
  const Problem problem = problem_of(body, kMetal);
  const KernelEffects plan = hardening_plan(0, 1e-6);
  Stepper stepper(problem, plan, false);
  const double dt = 0.8 * stable_step(problem, plan.damping);
  State state = at_rest(body);
  const auto turn = [&](double k, double* moment) {
    const std::vector<Vec3> before = state.velocity;
    stepper.advance(state, {}, {dt, dt, false});
    if (moment) *moment = 0;
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      const double y = body.rest[e].y() - 0.5 * n * h;
      const double side = body.rest[e].x() / h - 1;
      if (side == 0) continue;
      if (moment && side > 0)
        *moment += stepper.mass()[e] * (state.velocity[e].x() - before[e].x()) / dt * -y;
      state.displacement[e].x() = side * h * k * y;
      state.velocity[e].x() = 0;
    }
  };
  const int steps = 20000;
  double loaded = 0, unloaded = 0;
  for (int i = 1; i <= steps; ++i) turn(curvature * i / steps, nullptr);
  for (int i = 0; i < 2000; ++i) turn(curvature, &loaded);
  const double back = 0.5 * curvature;
  for (int i = 1; i <= steps; ++i) turn(curvature + (back - curvature) * i / steps, nullptr);
  for (int i = 0; i < 2000; ++i) turn(back, &unloaded);
  return back - unloaded * (curvature - back) / (loaded - unloaded);
}

TEST(Plasticity, BeamKeepsItsCurvature) {
  for (const int n : less_if_sanitized<std::vector<int>>({12, 16}, {12}, "one lattice of two")) {
    const double yields = kYield / kMetal.young / (0.5e-3 * n);  // curvature at which the surface yields
    for (const double times : {2.0, 4.0}) {
      const double moment = 1.5 * (1 - 1 / (3 * times * times));  // of that at first yield (Prager and Hodge)
      const double exact = (times - moment) * yields;
      EXPECT_NEAR(residual_curvature(n, times * yields), exact, 0.02 * exact) << n << " " << times;
    }
  }
}

// A deformed, yielded body: random, then drawn back a little, so that it is elastic around there.
State yielded(Stepper& stepper, const Body& body, double size) {
  State state = at_rest(body);
  const std::vector<Vec3> u = random_displacements(body, size, 3);
  for (const double share : {0.4, 0.8, 1.0}) {
    for (std::size_t e = 0; e < u.size(); ++e) state.displacement[e] = share * u[e];
    (void)forces_of(stepper, state);
  }
  for (Vec3& value : state.displacement) value *= 0.9995;
  return state;
}

TEST(Plasticity, ForcesAreTheDerivativeOfTheElasticEnergy) {
  BoxOptions options;
  options.cells = {3, 2, 2};
  options.spacing = Vec3(1e-3, 1.1e-3, 0.9e-3);
  options.axes = Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Body body = box_body(options);
  const Problem problem = problem_of(body, kMetal);
  Stepper stepper(problem, hardening_plan(1e8), false);
  State state = yielded(stepper, body, 1e-4);
  const std::vector<Vec3> force = forces_of(stepper, state);
  const Stepper::Memory before = stepper.memory();
  for (const double strain : stepper.plastic_strain(body.cell_count())) EXPECT_GT(strain, 0.01);
  const double step = 1e-11;
  double scale = 0;
  for (const Vec3& f : force) scale = std::max(scale, f.norm());
  for (std::size_t e = 0; e < body.element_count(); e += 5)
    for (int axis = 0; axis < 3; ++axis) {
      State moved = state;
      moved.displacement[e][axis] += step;
      const double up = *stepper.elastic_energy(moved);
      moved.displacement[e][axis] -= 2 * step;
      const double down = *stepper.elastic_energy(moved);
      EXPECT_NEAR(force[e][axis], -(up - down) / (2 * step), 1e-4 * scale);
    }
  const Stepper::Memory after = stepper.memory();
  EXPECT_EQ(0, std::memcmp(before.plastic.data(), after.plastic.data(),
                           before.plastic.size() * sizeof(step::PlasticBlock)));
}

TEST(Plasticity, FlowDoesNotSeeARotation) {
  const Body body = box_of({3, 2, 2});
  const Problem problem = problem_of(body, kMetal);
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  Stepper one(problem, hardening_plan(1e8), false), two(problem, hardening_plan(1e8), false);
  const std::vector<Vec3> u = random_displacements(body, 1e-4, 5), w = random_displacements(body, 1e-4, 6);
  for (const double share : {0.3, 0.7, 1.0}) {
    State a = at_rest(body), b = at_rest(body);
    for (std::size_t e = 0; e < u.size(); ++e) {
      a.displacement[e] = share * u[e] + share * share * w[e];
      // turned further at every context
      const Mat3 now =
          share < 1 ? Mat3(Eigen::AngleAxisd(3 * share, Vec3::UnitY()).toRotationMatrix()) : turn;
      b.displacement[e] = now * (body.rest[e] + a.displacement[e]) - body.rest[e];
    }
    const std::vector<Vec3> force = forces_of(one, a), turned = forces_of(two, b);
    double scale = 0;
    for (const Vec3& f : force) scale = std::max(scale, f.norm());
    if (share < 1) continue;
    for (std::size_t e = 0; e < u.size(); ++e) EXPECT_LT((turn * force[e] - turned[e]).norm(), 1e-9 * scale);
  }
  const std::vector<double> alpha = one.plastic_strain(body.cell_count()),
                            beta = two.plastic_strain(body.cell_count());
  for (std::size_t c = 0; c < alpha.size(); ++c) {
    EXPECT_GT(alpha[c], 0.01);
    EXPECT_NEAR(alpha[c], beta[c], 1e-10);
  }
}

struct Momenta {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};

Momenta momenta(const Body& body, const Stepper& stepper, const State& state) {
  Momenta sum;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const Vec3 p = stepper.mass()[e] * state.velocity[e];
    sum.linear += p;
    sum.angular += (body.rest[e] + state.displacement[e]).cross(p);
  }
  return sum;
}

TEST(Plasticity, KeepsMomentum) {
  const Body body = box_of({4, 3, 3});
  const Problem problem = problem_of(body, kMetal);
  const KernelEffects plan = hardening_plan(0, 1e-7);
  Stepper stepper(problem, plan, false);
  const double dt = 0.5 * stable_step(problem, plan.damping);
  State state = at_rest(body);
  state.velocity = random_displacements(body, 20, 9);
  const Momenta before = momenta(body, stepper, state);
  for (int i = 0; i < 500; ++i) ASSERT_GT(stepper.advance(state, {}, {dt, dt, false}).smallest_jacobian, 0);
  const Momenta after = momenta(body, stepper, state);
  double most = 0, scale = 0;
  for (const double strain : stepper.plastic_strain(body.cell_count())) most = std::max(most, strain);
  EXPECT_GT(most, 0.01);
  for (std::size_t e = 0; e < body.element_count(); ++e) scale += stepper.mass()[e] * 20;
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * scale);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * scale * 4e-3);
}

std::vector<Vec3> after_steps(const Body& body, const std::string& isa, int threads) {
  const ThreadLimit limit(threads);
  const Problem problem = problem_of(body, kMetal);
  const KernelEffects plan = hardening_plan(1e7, 1e-7);
  Stepper stepper(problem, plan, true, isa);
  const double dt = 0.5 * stable_step(problem, plan.damping);
  State state = at_rest(body);
  state.velocity = random_displacements(body, 10, 2);
  for (int i = 0; i < 60; ++i) stepper.advance(state, {}, {dt, dt, false});
  for (const double strain : stepper.plastic_strain(body.cell_count()))
    state.displacement.push_back(Vec3::Constant(strain));
  return state.displacement;
}

TEST(Plasticity, BitsDoNotDependOnThreadsOrInstructions) {
  const Body body = box_of({20, 13, 12});
  const std::vector<Vec3> one = after_steps(body, "portable", 1);
  EXPECT_GT(one.back().x(), 0);
  EXPECT_EQ(one, after_steps(body, "portable", 3));
  const std::string best = kernel_table("").isa;
  EXPECT_EQ(one, after_steps(body, best, 2));
  if (best == "avx512") {
    EXPECT_EQ(one, after_steps(body, "avx2", 1));
  }
}

// Below its yield stress a body moves as without plasticity but for rounding.
TEST(Plasticity, BelowYieldThereIsNone) {
  const Body body = box_of({6, 3, 3});
  const Problem problem = problem_of(body, kMetal);
  Stepper bare(problem, {{0}}, false), plastic(problem, {{0}, {{1e8, 0}}, {}}, false);
  const double dt = 0.5 * stable_step(problem, {0});
  State a = at_rest(body);
  a.velocity = random_displacements(body, 1, 4);
  State b = a;
  double size = 0;
  for (int i = 0; i < 300; ++i) {
    bare.advance(a, {}, {dt, dt, false});
    plastic.advance(b, {}, {dt, dt, false});
  }
  for (const Vec3& u : a.displacement) size = std::max(size, u.norm());
  for (std::size_t e = 0; e < a.displacement.size(); ++e)
    EXPECT_LT((a.displacement[e] - b.displacement[e]).norm(), 1e-9 * size);
  for (const double strain : plastic.plastic_strain(body.cell_count())) EXPECT_EQ(strain, 0);
}

TEST(Plasticity, RefusesWhatCannotFlow) {
  const std::string begin = "material = \"copper\"\n[run]\ntime = \"1 us\"\n[plasticity]\n";
  EXPECT_THAT(refusal(begin), HasSubstr("no part can flow: write yield"));
  EXPECT_THAT(refusal(begin + "yield = \"1\"\n"), HasSubstr("has no unit"));
  EXPECT_THAT(refusal(begin + "yield = \"-1 Pa\"\n"), HasSubstr("above 0"));
  EXPECT_THAT(refusal(begin + "yield = \"1 MPa\"\npart = \"bax\"\n"), HasSubstr("no part \"bax\""));
  EXPECT_THAT(refusal("material = \"steel\"\n[plasticity]\nyield = \"1 MPa\"\n"), HasSubstr("time"));
}

}  // namespace
}  // namespace flexel::simulate
