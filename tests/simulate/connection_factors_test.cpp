// Columns of single connections of model `paper`: what they make of k, b, t, mu and l, the file, and refusals. The
// damping as a matrix, for implicit steps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/lattice/body_file.h"
#include "simulate/implicit/damping_matrix.h"
#include "simulate/linear/operator.h"
#include "simulate/models/cells.h"
#include "simulate/paper/connection_friction.h"
#include "simulate/paper/connection_yield.h"
#include "tests/scratch.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::centre_body;
using testing::CentreOptions;
using ::testing::HasSubstr;
using testing::refusal;
using testing::TimedCase;

constexpr double kWide = 0.01;  // m
constexpr std::size_t kBits = half_neighbourhood.size();

Body lattice_of(Index3 voxels) {
  CentreOptions options;
  options.voxels = voxels;
  options.spacing = kWide;
  return centre_body(options);
}

Problem gum_problem(const Body& body) {
  return {body, {{"gum", 1e6, 0.25, 1000, ""}}, {}, {Model::paper}, {HookeConstant::paper}, {}};
}

Scene gum_scene_of(const std::string& text) {
  return parse_scene(
      "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.25\ndensity = \"1000 kg/m3\"\n" +
          text,
      "scene.toml");
}

// The column of every connection, of `change(element, bit)`.
template <class Change>
void set_connections(Body& body, const std::string& what, const Change& change) {
  Column column{static_cast<int>(kBits), {}};
  for (std::size_t e = 0; e < body.element_count(); ++e)
    for (std::size_t bit = 0; bit < kBits; ++bit) column.values.push_back(change(e, bit));
  body.element_columns[what] = std::move(column);
}

State random_state(const Body& body) {
  State state = testing::at_rest(body);
  state.displacement = testing::random_displacements(body, 0.1 * kWide, 3);
  state.velocity = testing::random_displacements(body, 1, 4);
  state.kick = 1e-5;
  return state;
}

// Forces on all elements in a random state: elastic, damping, friction.
std::array<std::vector<Vec3>, 3> forces_of_connections(const Body& body) {
  const Problem problem = gum_problem(body);
  const PaperModel model(problem);
  const State state = random_state(body);
  std::array<std::vector<Vec3>, 3> forces;
  forces.fill(std::vector<Vec3>(body.element_count(), Vec3::Zero()));
  model.add_forces(state, forces[0]);
  model.add_damping(state, {1e-4}, forces[1]);
  std::optional<ConnectionFriction> friction =
      ConnectionFriction::make({{{0.01, std::nullopt, ""}}}, problem);
  friction->attach(model, {1e-4});
  friction->add_forces(state, forces[2]);
  return forces;
}

double unlike_by(const std::vector<Vec3>& a, const std::vector<Vec3>& b, double factor = 1) {
  double most = 0, size = 0;
  for (std::size_t e = 0; e < a.size(); ++e) {
    most = std::max(most, (a[e] - factor * b[e]).norm());
    size = std::max(size, a[e].norm());
  }
  return most / size;
}

// The same factor on every connection is that factor on every element; both multiply.
TEST(ConnectionFactors, OnEveryConnectionAreThoseOnEveryElement) {
  const Body plain = lattice_of({3, 3, 2});
  const auto bare = forces_of_connections(plain);
  for (const auto& [what, which] : {std::pair{"stiffness", 0}, {"damping", 1}, {"friction", 2}}) {
    const auto at = static_cast<std::size_t>(which);
    const std::string of_elements = std::string(what) + "_change";
    Body elements = plain, connections = plain;
    elements.element_columns[of_elements] = {1, std::vector<double>(plain.element_count(), 0.5)};
    set_connections(connections, "connection_" + of_elements, [](std::size_t, std::size_t) { return 0.5; });
    const auto by_elements = forces_of_connections(elements),
               by_connections = forces_of_connections(connections);
    for (std::size_t kind = 0; kind < 3; ++kind)
      EXPECT_LT(unlike_by(by_elements[kind], by_connections[kind]), 1e-14) << what << kind;
    EXPECT_LT(unlike_by(by_elements[at], bare[at], 1.5), 1e-14) << what;
    connections.element_columns[of_elements] = elements.element_columns[of_elements];
    EXPECT_LT(unlike_by(forces_of_connections(connections)[at], bare[at], 2.25), 1e-14) << what;
  }
}

// One connection alone: k of the first element's connection along x, doubled.
TEST(ConnectionFactors, OfOneConnectionChangeItAlone) {
  Body body = lattice_of({3, 1, 1});
  set_connections(body, "connection_stiffness_change",
                  [](std::size_t e, std::size_t bit) { return e == 0 && bit == 0 ? 1.0 : 0.0; });
  const PaperModel model(gum_problem(body));
  const double k = 1e6 * kWide;
  EXPECT_DOUBLE_EQ(model.stiffness(0, model.rows().of(0)[0]), 2 * k);
  EXPECT_DOUBLE_EQ(model.stiffness(1, model.rows().of(1)[0]), 2 * k);
  EXPECT_DOUBLE_EQ(model.stiffness(1, model.rows().of(1)[1]), k);
}

// t = l (1 + elongation factor), of one connection.
TEST(ConnectionFactors, AThresholdOfItsOwn) {
  Body body = lattice_of({3, 1, 1});
  set_connections(body, "connection_strength_change",
                  [](std::size_t e, std::size_t) { return e == 0 ? 1.0 : 0.0; });
  const Problem problem = gum_problem(body);
  const auto broken_at = [&](double stretched) {
    PaperModel model(problem);
    FractureLimits limits;
    limits.elongation = 0.1;
    ConnectionYield yield(problem, {{0}, {}, {limits}}, model);
    State state = testing::at_rest(body);
    for (std::size_t e = 0; e < 3; ++e)
      state.displacement[e].x() = stretched * kWide * static_cast<double>(e);
    return yield.advance(state).broken;
  };
  EXPECT_EQ(broken_at(0.099), 0u);
  EXPECT_EQ(broken_at(0.101), 1u);
  EXPECT_EQ(broken_at(0.199), 1u);
  EXPECT_EQ(broken_at(0.201), 2u);
}

// Random columns of all five: the file gives them back to the bit, and with them the forces.
TEST(ConnectionFactors, TheFileKeepsThem) {
  Body body = lattice_of({3, 2, 2});
  unsigned seed = 7;
  const auto any = [&](double size) {
    seed = seed * 1664525u + 1013904223u;
    return size * (seed / 4294967296.0 - 0.5);
  };
  for (const char* what : {"stiffness", "damping", "strength", "friction"})
    set_connections(body, std::string("connection_") + what + "_change",
                    [&](std::size_t, std::size_t) { return any(1); });
  set_connections(body, "connection_rest", [&](std::size_t, std::size_t) { return any(0.1 * kWide); });
  const flexel::test::Scratch scratch;
  const std::string path = scratch.path("connections.vtu");
  write_body(body, path);
  const Body again = read_body(path);
  const auto before = forces_of_connections(body), after = forces_of_connections(again),
             plain = forces_of_connections(lattice_of({3, 2, 2}));
  EXPECT_EQ(before, after);
  for (std::size_t kind = 0; kind < 3; ++kind) EXPECT_GT(unlike_by(before[kind], plain[kind]), 0.01) << kind;
}

// An edit of connections: those within a box, or those that leave it; its length is that of each.
TEST(ConnectionFactors, AnEditSetsThoseInsideOrAcross) {
  const Body body = lattice_of({4, 1, 1});
  const std::string box =
      "where = { box = { min = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], max = [\"20 mm\", \"11 mm\", \"11 mm\"] } "
      "}\n";
  const auto edited = [&](const std::string& keys) {
    Body made = body;
    (void)testing::simulate_quietly(
        made, gum_scene_of("[run]\ntime = \"1 us\"\n[[event]]\nat = \"0 s\"\ndo = \"edit\"\n" + box + keys));
    return made;
  };
  const double k = 1e6 * kWide;
  for (const auto& [which, changed] : {std::pair{"inside", 0u}, {"across", 1u}}) {
    const std::string connections = "connections = \"" + std::string(which) + "\"\n";
    const Body stiff = edited(connections + "stiffness = 2\n"),
               longer = edited(connections + "length = 1.1\n");
    const PaperModel model(gum_problem(stiff)), stretched(gum_problem(longer));
    for (std::uint32_t e = 0; e < 3; ++e) {
      const ConnectionRows::Entry& entry = model.rows().of(e).back();
      EXPECT_DOUBLE_EQ(model.stiffness(e, entry), e == changed ? 2 * k : k) << which << e;
      const ConnectionRows::Entry& same = stretched.rows().of(e).back();
      EXPECT_NEAR(stretched.stretched(testing::at_rest(body), e, same).elongation,
                  e == changed ? -0.1 * kWide : 0, 1e-12 * kWide);
    }
  }
  // factors multiply
  const std::string twice = "connections = \"across\"\nstrength = 2\n";
  EXPECT_EQ(edited(twice + "[[event]]\nat = \"0 s\"\ndo = \"edit\"\n" + box + twice)
                .element_columns.at("connection_strength_change")
                .values[kBits * 1],
            3);
  const auto refused = [&](const Body& of, const std::string& keys) {
    try {
      Body made = of;
      (void)testing::simulate_quietly(made, gum_scene_of("[[event]]\ndo = \"edit\"\n" + keys));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused(body, "length = 2\n"), HasSubstr("\"length\" is that of connections"));
  EXPECT_THAT(refused(body, "connections = \"all\"\nstiffness = 2\n"), HasSubstr("choose \"inside\" or"));
  EXPECT_THAT(refused(body, "connections = \"inside\"\ndensity = 2\n"), HasSubstr("no density"));
  EXPECT_THAT(refused(body, "connections = \"across\"\nstiffness = 2\n"), HasSubstr("across the border of"));
  EXPECT_THAT(refused(testing::box_body({}), "connections = \"inside\"\nstiffness = 2\n"),
              HasSubstr("no connection of model \"paper\""));
}

TEST(ConnectionFactors, DamagedColumnsAreRefusedInOneLine) {
  const Scene pull =
      gum_scene_of("[[fix]]\nwhere = \"xmin\"\n[[load]]\nwhere = \"xmax\"\nforce = [\"0.1 N\", 0, 0]\n");
  const Body plain = lattice_of({3, 2, 2});
  EXPECT_EQ(refusal(plain, pull), "accepted");
  const auto damaged = [&](const std::string& name, Column column) {
    Body body = plain;
    body.element_columns[name] = std::move(column);
    return refusal(body, pull);
  };
  const std::size_t n = plain.element_count();
  EXPECT_THAT(
      damaged("connection_stiffness_change", {12, std::vector<double>(12 * n, 0)}),
      HasSubstr("column \"connection_stiffness_change\" of the body has 12 numbers a row: it needs 13"));
  EXPECT_THAT(damaged("connection_rest", {1, std::vector<double>(n, 0)}), HasSubstr("it needs 13"));
  EXPECT_THAT(damaged("stiffness_change", {3, std::vector<double>(3 * n, 0)}), HasSubstr("it needs 1"));
  EXPECT_THAT(damaged("connection_friction_change", {1, std::vector<double>(n, 0)}),
              HasSubstr("it needs 13"));
  std::vector<double> values(kBits * n, 0);
  values[0] = -1;
  EXPECT_THAT(damaged("connection_damping_change", {static_cast<int>(kBits), values}),
              HasSubstr("connection 0 of element 0 has -1, a factor less 1: it needs to be above -1"));
  values[0] = -kWide;
  EXPECT_THAT(damaged("connection_rest", {static_cast<int>(kBits), values}),
              HasSubstr("leaves nothing of its length"));
}

// Each column has one place: at elements where these stand for voxels, at cells where there are cells.
TEST(ConnectionFactors, ColumnsThatNothingTakesAreRefusedByName) {
  const Scene pull =
      gum_scene_of("[[fix]]\nwhere = \"xmin\"\n[[load]]\nwhere = \"xmax\"\nforce = [\"0.1 N\", 0, 0]\n");
  const Body corner = testing::box_body({}), centre = lattice_of({3, 2, 2});
  const auto with = [&](Body body, bool of_elements, const std::string& name, int components, double value) {
    const std::size_t rows = of_elements ? body.element_count() : body.cell_count();
    Columns& columns = of_elements ? body.element_columns : body.cell_columns;
    columns[name] = {components, std::vector<double>(rows * static_cast<std::size_t>(components), value)};
    return refusal(body, pull);
  };
  for (const char* name :
       {"stiffness_change", "damping_change", "density_change", "strength_change", "yield_change"}) {
    EXPECT_EQ(with(centre, true, name, 1, 1), "accepted") << name;
    EXPECT_EQ(with(corner, false, name, 1, 1), "accepted") << name;
    EXPECT_EQ(with(corner, true, name, 1, 0), "accepted") << name;
    EXPECT_THAT(with(corner, true, name, 1, 1), HasSubstr("write it into the cell data")) << name;
  }
  EXPECT_THAT(with(corner, true, "radius_change", 1, 1), HasSubstr("no radius"));
  EXPECT_THAT(with(corner, true, "connection_stiffness_change", 13, 1), HasSubstr("model \"paper\""));
  for (const char* name : {"friction_change", "radius_change", "stick_change"})
    EXPECT_THAT(with(corner, false, name, 1, 1), HasSubstr("write it into the point data")) << name;
  EXPECT_THAT(with(corner, false, "connection_damping_change", 13, 1),
              HasSubstr("write it into the point data"));
  EXPECT_EQ(with(corner, true, "friction_change", 1, 1), "accepted");
}

// A stiffer damping bounds the step: ten thousand times that of one connection, and the run stays whole.
TEST(ConnectionFactors, TheStepHeedsTheDampingOfOneConnection) {
  Body body = lattice_of({4, 2, 2});
  set_connections(body, "connection_damping_change",
                  [](std::size_t e, std::size_t bit) { return e == 5 && bit == 0 ? 300.0 : 0.0; });
  const TimedCase made =
      testing::run_timed(body, gum_scene_of("[damping]\ntime = \"20 us\"\n[[velocity]]\nwhere = { box = { "
                                            "min = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], "
                                            "max = [\"20 mm\", \"21 mm\", \"21 mm\"] } }\nvelocity = [\"0.1 "
                                            "m/s\", 0, 0]\n[run]\ntime = \"10 ms\"\n"));
  testing::expect_books_close(made.result);
  const double kinetic = made.history.column("kinetic").back();
  EXPECT_LT(kinetic, made.history.column("kinetic").front() * 1.001);
}

// C v of implicit steps is what explicit steps brake with.
TEST(ConnectionFactors, TheDampingMatrixIsThatOfExplicitSteps) {
  Body body = lattice_of({3, 3, 2});
  body.element_columns["damping_change"] = {1, std::vector<double>(body.element_count(), 0)};
  for (std::size_t e = 0; e < body.element_count(); e += 2)
    body.element_columns["damping_change"].values[e] = 0.7;
  set_connections(body, "connection_stiffness_change",
                  [](std::size_t e, std::size_t bit) { return 0.1 * static_cast<double>((e + bit) % 5); });
  const Problem problem = gum_problem(body);
  const PaperModel model(problem);
  const State state = random_state(body);
  const StiffnessPattern pattern = stiffness_pattern(body, active_cells(problem), model.rows());
  BlockMatrix matrix = pattern.matrix;
  for (Block& block : matrix.values) block.setConstant(17);  // all of it is set
  set_damping(problem, pattern.stencil, model, {1e-4}, state.displacement, matrix);
  std::vector<Vec3> pulled(body.element_count()), forces(body.element_count(), Vec3::Zero());
  multiply(matrix, state.velocity, pulled);
  model.add_damping(state, {1e-4}, forces);
  EXPECT_LT(unlike_by(pulled, forces, -1), 1e-12);
}

// A bar hung by one end, damped, by implicit steps: towards what explicit steps say at first order, and to the
// equilibrium by long ones.
TEST(ConnectionFactors, DampedImplicitStepsConvergeToExplicitOnes) {
  const Body body = lattice_of({5, 2, 2});
  const auto scene = [&](const std::string& run) {
    return gum_scene_of(
        "[[fix]]\nwhere = \"xmin\"\n[gravity]\nacceleration = [\"200 m/s2\", 0, \"20 m/s2\"]\n" + run);
  };
  const std::string damped = "[damping]\ntime = \"1 ms\"\n[run]\n";
  const auto way = [&](const std::string& run) {
    const TimedCase made = testing::run_timed(body, scene(damped + run));
    testing::expect_books_close(made.result);
    EXPECT_GT(made.history.column("damping dissipated").back(), 0);
    return Vec3(made.body.position.back() - made.body.rest.back());
  };
  const Vec3 exact = way("time = \"8 ms\"\n");
  const std::string implicit = "method = \"implicit\"\ntolerance = 1e-10\n";
  const double coarse = (way("time = \"8 ms\"\nstep = \"80 us\"\n" + implicit) - exact).norm(),
               fine = (way("time = \"8 ms\"\nstep = \"40 us\"\n" + implicit) - exact).norm();
  EXPECT_LT(fine, 0.05 * exact.norm());
  EXPECT_NEAR(coarse / fine, 2, 0.3);
  Body still = body;
  (void)testing::simulate_quietly(still, scene(""));
  const Vec3 sag = still.position.back() - still.rest.back();
  // in time a fix whose surface cuts through the lattice is softer (docs/reference/motion.md)
  const Vec3 rested = way("time = \"2 s\"\nstep = \"20 ms\"\n" + implicit);
  EXPECT_LT((rested - sag).norm(), 1e-2 * sag.norm());
  EXPECT_LT((way("time = \"2 s\"\nstep = \"5 ms\"\n" + implicit) - rested).norm(), 1e-6 * sag.norm());
}

}  // namespace
}  // namespace flexel::simulate
