// Fracture of model `cells`: strength and elongation, books, symmetries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <numeric>
#include <sstream>

#include "base/error.h"
#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "simulate/models/cell_model.h"
#include "simulate/scene/scene.h"
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

const Material kGlass{"glass", 1e9, 0.25, 1000, "test"};
constexpr double kStrength = 5e6;

KernelEffects fracture_plan(double strength, double damping = 0) {
  FractureLimits limits;
  limits.strength = strength;
  return {{damping}, {}, {limits}};
}

// A bar of 2 x 2 x 8 mm that is pulled ever harder; its wave runs through it and back in 16 us.
const char* const kTornBar = R"(
material = "glass"
[materials.glass]
young = "1 GPa"
poisson = 0.25
density = "1000 kg/m3"
strength = "5 MPa"
[fracture]
[damping]
time = "1 us"
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
force = ["22 N", "0 N", "0 N"]
time = ["0 s", "3.6 ms"]
factor = [0, 1]
[run]
time = "3.35 ms"
history_every = "1 us"
)";

struct Broke {
  double time = 0, worst = 0;
  SimulateResult result;
};

// When the books first tell of energy released by fracture.
Broke run_to_fracture(Body& body, const Scene& scene) {
  SimulateOptions options;
  const flexel::test::Scratch scratch;
  options.history = scratch.path("fracture.csv");
  Progress progress("test", Progress::Mode::quiet);
  Broke broke;
  broke.result = simulate(body, scene, options, progress);
  broke.worst = testing::book(broke.result, "worst_residual") / testing::book(broke.result, "largest_term");
  std::ifstream file(options.history);
  std::string line, cell;
  std::getline(file, line);
  std::size_t column = 0;
  std::istringstream names(line);
  while (std::getline(names, cell, ',') && cell != "fracture dissipated [J]") ++column;
  while (std::getline(file, line)) {
    std::istringstream row(line);
    for (std::size_t c = 0; std::getline(row, cell, ','); ++c) {
      if (c == 0) broke.time = std::stod(cell);
      if (c == column && std::stod(cell) > 0) return broke;
    }
  }
  broke.time = 0;
  return broke;
}

TEST(Fracture, BarPartsAtItsStrength) {
  Body body = box_of({8, 2, 2});
  const Broke broke = run_to_fracture(body, parse_scene(kTornBar, "bar.toml"));
  // 22 N / 3.6 ms over 4 mm2 at rest, drawn in by Poisson's effect
  const double strain = kStrength / kGlass.young, area = 4e-6 * std::pow(1 - kGlass.poisson * strain, 2);
  const double stress = 22 * broke.time / 3.6e-3 / area;
  EXPECT_NEAR(stress, kStrength, 0.01 * kStrength);
  EXPECT_LT(broke.worst, 1e-3);
  EXPECT_GT(std::accumulate(body.broken.begin(), body.broken.end(), 0), 0);
}

// The weakest part of a bar is where it parts: a layer with fewer cells. What hangs on beyond it flies off.
TEST(Fracture, NotchPartsAndTheRestFliesOff) {
  BoxOptions options;
  options.cells = {9, 3, 1};
  options.spacing = Vec3::Constant(1e-3);
  options.fill = [](int i, int j, int) { return i == 4 && j != 1 ? 0.0 : 1.0; };
  Body body = box_body(options);
  Scene scene = parse_scene(kTornBar, "bar.toml");
  scene.get<Loads>().loads[0].force = Vec3(20, 0, 0);
  scene.run.time = 1.7e-3;
  const Broke broke = run_to_fracture(body, scene);
  EXPECT_GT(broke.time, 0.5e-3);
  EXPECT_LT(broke.worst, 1e-3);
  // no way through any more
  const Adjacency adjacency = element_adjacency(body);
  std::vector<std::uint8_t> reached(body.element_count(), 0);
  std::vector<std::uint32_t> todo{0};
  while (!todo.empty()) {
    const std::uint32_t e = todo.back();
    todo.pop_back();
    if (reached[e]) continue;
    reached[e] = 1;
    EXPECT_LT(body.rest[e].x(), 5.5e-3);
    for (const std::uint32_t n : adjacency.of(e)) todo.push_back(n);
  }
  EXPECT_GT(body.position.back().x() - body.rest.back().x(), 1e-3);
}

const char* const kDuctile = R"(
yield = "2 MPa"
hardening = "100 MPa"
elongation = 0.02
[plasticity]
)";

TEST(Fracture, DuctileBarPartsAtItsElongation) {
  std::string text = kTornBar;
  text.replace(text.find("strength = \"5 MPa\"\n"), 19, kDuctile);
  const std::size_t load = text.find("[[load]]"), end = text.find("[run]");
  text.replace(load, end - load,
               "[[move]]\nwhere = \"xmax\"\ndisplacement = [\"0.4 mm\", \"free\", \"free\"]\n"
               "time = [\"0 s\", \"4 ms\"]\nfactor = [0, 1]\n");
  text.replace(text.find("3.35 ms"), 7, "2.2 ms");
  Body body = box_of({8, 2, 2});
  const Broke broke = run_to_fracture(body, parse_scene(text, "bar.toml"));
  const double strain = std::log1p(0.4 * broke.time / 4e-3 / 8);
  const double exact = 0.02 + (2e6 + 100e6 * 0.02) / kGlass.young;
  EXPECT_NEAR(strain, exact, 0.01 * exact);
  EXPECT_LT(broke.worst, 1e-3);
}

// The exact criterion, whatever the direction of the stress: cells of random stress against their
// eigenvalues.
TEST(Fracture, BreaksByTheLargestPrincipalStress) {
  int broke = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Body body = box_of({1, 1, 1});
    const Problem problem = problem_of(body, kGlass);
    State state = at_rest(body);
    const std::vector<Vec3> rows = random_displacements(body, 0.006, seed);
    Mat3 h;
    h << rows[0].transpose(), rows[1].transpose(), rows[2].transpose();
    for (std::size_t e = 0; e < 8; ++e) state.displacement[e] = h * body.rest[e];
    const Mat3 f = Mat3::Identity() + h;
    const Mat3 cauchy =
        simulate::stress(cell_kind(body.parts[0].lattice, kGlass), h) * f.transpose() / f.determinant();
    const double largest = Eigen::SelfAdjointEigenSolver<Mat3>(cauchy).eigenvalues()[2];
    for (const double share : {1 - 1e-9, 1 + 1e-9}) {
      if (!(largest > 0)) continue;
      Stepper stepper(problem, fracture_plan(share * largest), false);
      (void)forces_of(stepper, state);
      std::vector<std::uint8_t> broken(1, 0);
      EXPECT_EQ(stepper.mark_broken(broken), share < 1) << seed;
      broke += broken[0];
    }
  }
  EXPECT_GT(broke, 100);
}

// Model springs: a bar parts where its springs along it have reached t = l (1 + strength / E).
TEST(Fracture, SpringsPartAtTheirLength) {
  for (const char* limit : {"strength = \"5 MPa\"", "elongation = 0.005"}) {
    std::string text = kTornBar;
    text.replace(text.find("strength = \"5 MPa\""), 18, limit);
    text += "[parts.box]\nmodel = \"springs\"\n";
    Body body = box_of({8, 2, 2});
    const Broke broke = run_to_fracture(body, parse_scene(text, "bar.toml"));
    const double stress = 22 * broke.time / 3.6e-3 / 4e-6;
    EXPECT_NEAR(stress, kStrength, 0.01 * kStrength) << limit;
    EXPECT_LT(broke.worst, 1e-3);
    EXPECT_GT(std::accumulate(body.broken.begin(), body.broken.end(), 0), 0);
  }
}

struct Outcome {
  std::vector<Vec3> displacement;
  std::vector<std::uint8_t> broken;
};

Outcome burst(const Body& body, double strength, const std::string& isa, int threads, bool book = true,
              Model model = Model::cells) {
  const ThreadLimit limit(threads);
  const Problem problem = problem_of(body, kGlass, model);
  KernelEffects plan = fracture_plan(strength, 2e-7);
  if (model == Model::springs) plan.fracture[0] = {plan.fracture[0].elongation, strength / kGlass.young};
  Stepper stepper(problem, std::isfinite(strength) ? plan : KernelEffects{plan.damping}, book, isa);
  const double dt = 0.5 * stable_step(problem, plan.damping);
  State state = at_rest(body);
  state.velocity = random_displacements(body, 15, 2);
  for (int i = 0; i < 60; ++i) stepper.advance(state, {}, {dt, dt, false});
  Outcome outcome{state.displacement, std::vector<std::uint8_t>(body.cell_count(), 0)};
  stepper.mark_broken(outcome.broken);
  return outcome;
}

TEST(Fracture, BitsDoNotDependOnThreadsInstructionsOrBooks) {
  const Body body = box_of({20, 13, 12});
  const Outcome one = burst(body, kStrength, "portable", 1);
  const auto count = std::accumulate(one.broken.begin(), one.broken.end(), 0u);
  EXPECT_GT(count, 100u);
  EXPECT_LT(count, body.cell_count());
  const std::string best = kernel_table("").isa;
  for (const Outcome& other : {burst(body, kStrength, "portable", 3), burst(body, kStrength, best, 2),
                               burst(body, kStrength, best, 1, false)}) {
    EXPECT_EQ(one.displacement, other.displacement);
    EXPECT_EQ(one.broken, other.broken);
  }
}

// The kernel with fracture is the one without as long as nothing breaks, to the bit. Of springs it is another
// one: those that break are summed cell by cell, the others connection by connection.
TEST(Fracture, NothingChangesWhereNothingBreaks) {
  const Body body = box_of({7, 5, 6});
  constexpr double never = std::numeric_limits<double>::infinity();
  EXPECT_EQ(burst(body, 1e12, "", 2).displacement, burst(body, never, "", 2).displacement);
  const std::vector<Vec3> with = burst(body, 1e12, "", 2, true, Model::springs).displacement;
  const std::vector<Vec3> without = burst(body, never, "", 2, true, Model::springs).displacement;
  double farthest = 0, difference = 0;
  for (std::size_t e = 0; e < with.size(); ++e) {
    farthest = std::max(farthest, without[e].norm());
    difference = std::max(difference, (with[e] - without[e]).norm());
  }
  EXPECT_LT(difference, 1e-12 * farthest);
}

TEST(Fracture, BitsOfSpringsDoNotDependOnThreadsInstructionsOrBooks) {
  const Body body = box_of({20, 13, 12});
  const Outcome one = burst(body, 2e6, "portable", 1, true, Model::springs);
  const auto count = std::accumulate(one.broken.begin(), one.broken.end(), 0u);
  EXPECT_GT(count, 10u);
  EXPECT_LT(count, body.cell_count());
  for (const Outcome& other :
       {burst(body, 2e6, "", 3, true, Model::springs), burst(body, 2e6, "", 1, false, Model::springs)}) {
    EXPECT_EQ(one.displacement, other.displacement);
    EXPECT_EQ(one.broken, other.broken);
  }
}

TEST(Fracture, DebrisKeepsMomentum) {
  const Body body = box_of({5, 4, 4});
  const Problem problem = problem_of(body, kGlass);
  const KernelEffects plan = fracture_plan(kStrength, 1e-7);
  Stepper stepper(problem, plan, false);
  const double dt = 0.5 * stable_step(problem, plan.damping);
  State state = at_rest(body);
  state.velocity = random_displacements(body, 20, 9);
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  const auto add = [&](double sign) {
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      const Vec3 p = sign * stepper.mass()[e] * state.velocity[e];
      linear += p;
      angular += (body.rest[e] + state.displacement[e]).cross(p);
    }
  };
  add(-1);
  std::uint64_t broken = 0;
  for (int i = 0; i < 500; ++i) broken += stepper.advance(state, {}, {dt, dt, false}).broken;
  add(1);
  EXPECT_GT(broken, 10u);
  double scale = 0;
  for (const double mass : stepper.mass()) scale += mass * 20;
  EXPECT_LT(linear.norm(), 1e-12 * scale);
  EXPECT_LT(angular.norm(), 1e-12 * scale * 5e-3);
}

TEST(Fracture, RefusesWhatCannotBreak) {
  const std::string begin = "material = \"copper\"\n[run]\ntime = \"1 us\"\n[fracture]\n";
  EXPECT_THAT(refusal(begin), HasSubstr("no part can break: write strength"));
  EXPECT_THAT(refusal(begin + "elongation = 0.2\n"), HasSubstr("add [plasticity]"));
  EXPECT_THAT(refusal(begin + "strength = \"0 Pa\"\n"), HasSubstr("above 0"));
  EXPECT_THAT(refusal(begin + "strength = \"1 MPa\"\npart = \"bax\"\n"), HasSubstr("no part \"bax\""));
  EXPECT_THAT(refusal(begin + "strenght = \"1 MPa\"\n"), HasSubstr("strength"));
}

}  // namespace
}  // namespace flexel::simulate
