// Rigid balls and plates that push at equilibrium: their shape, their forces, what comes of them, and what is refused.
#include "simulate/indent/indenters.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <random>

#include "formats/lattice/fragments_of_body.h"
#include "simulate/equilibrium/mechanics.h"
#include "simulate/linear/vector_products.h"
#include "simulate/matter/surface_points.h"
#include "simulate/probes/report.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/printed.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kGumYoung;

const std::string kGum =
    "material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\ndensity = \"1000 kg/m3\"\n";
const std::string kOnTheGround = "[[fix]]\nwhere = \"box/z0\"\n";

std::string in_mm(const Vec3& v) {
  return fmt::format("[\"{:.17g} m\", \"{:.17g} m\", \"{:.17g} m\"]", v.x(), v.y(), v.z());
}

std::string ball(const Vec3& centre, double radius, const Vec3& way) {
  return fmt::format(
      "[[indenter]]\nname = \"tool\"\nball = {{ centre = {}, radius = \"{:.17g} m\" }}\ndisplacement = {}\n",
      in_mm(centre), radius, in_mm(way));
}

std::string plate(const Vec3& centre, double radius, const Vec3& way) {
  return fmt::format(
      "[[indenter]]\nname = \"tool\"\nplate = {{ centre = {}, normal = [0, 0, -1], radius = \"{:.17g} m\" "
      "}}\n"
      "displacement = {}\n",
      in_mm(centre), radius, in_mm(way));
}

Scene scene_of(const std::string& text) {
  return parse_scene(kGum + text, "s.toml");
}

SimulateResult solve(Body& body, const std::string& text) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions how;
  how.estimate = false;
  return simulate(body, scene_of(text), how, progress);
}

Indenters indenters_of(const Scene& scene, const Problem& problem) {
  std::optional<Indenters> made = Indenters::make(scene.get<Indenters>(), problem);
  if (!made) throw std::logic_error("the scene has no indenters");
  return *std::move(made);
}

// Cells, of the first indenter, in a body as it is now.
double deepest(const Scene& scene, const Body& body, const State& state) {
  const Problem problem{body, materials_of_parts(scene, body), {}};
  return indenters_of(scene, problem).depths(state)[0];
}

std::vector<std::string> warnings(const Body& body, const std::string& text) {
  const Scene scene = scene_of(text);
  const Problem problem{body, materials_of_parts(scene, body), {}};
  return indenters_of(scene, problem).warnings(state_of(body));
}

std::vector<Vec3> any_vectors(std::size_t count, double size) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> uniform(-size, size);
  std::vector<Vec3> values;
  for (std::size_t i = 0; i < count; ++i)
    values.emplace_back(uniform(engine), uniform(engine), uniform(engine));
  return values;
}

// 4 x 4 x 2 cells of 10 mm; the top is at 20 mm.
Body low_box() {
  return box_body({.cells = {4, 4, 2}, .spacing = Vec3::Constant(0.01)});
}

class ShapeOf : public ::testing::TestWithParam<IndenterShape> {};

TEST_P(ShapeOf, TheGapIsADistanceWithItsDerivatives) {
  const IndenterShape shape = GetParam();
  const IndenterPlace place{Vec3(0.01, -0.02, 0.005), Vec3(1, 2, -2).normalized()};
  const double step = 1e-7;
  int outside = 0;
  for (const Vec3& offset : any_vectors(300, 0.02)) {
    const Vec3 point = place.centre + offset;
    const IndenterGap gap = gap_to(shape, place, point);
    EXPECT_NEAR(gap.gradient.norm(), 1, 1e-12);
    if (gap.distance < -0.9 * shape.rounding) continue;  // in the core, or beside it
    outside += gap.distance > 0;
    // a step along the gradient leads as far away
    EXPECT_NEAR(gap_to(shape, place, point + 0.001 * gap.gradient).distance, gap.distance + 0.001, 1e-12);
    for (int axis = 0; axis < 3; ++axis) {
      const IndenterGap more = gap_to(shape, place, point + step * Vec3::Unit(axis)),
                        less = gap_to(shape, place, point - step * Vec3::Unit(axis));
      EXPECT_NEAR((more.distance - less.distance) / (2 * step), gap.gradient[axis], 1e-5);
      EXPECT_LT(((more.gradient - less.gradient) / (2 * step) - gap.curvature.col(axis)).norm(),
                1e-4 * gap.curvature.norm() + 1e-3);
    }
  }
  EXPECT_GT(outside, 100);
}

// Beside points close together on the way, of paths that begin and end outside. (Its own are half of that depth apart.)
TEST_P(ShapeOf, WhatGoesThroughIsDeepOnTheWay) {
  const IndenterShape shape = GetParam();
  const std::vector<Vec3> any = any_vectors(4000, 0.02);
  const double deep = 0.25 * shape.rounding, near = 1e-2 * deep;
  int through = 0, past = 0;
  for (std::size_t i = 0; i + 3 < any.size(); i += 4) {
    const std::array<IndenterPlace, 2> places{
        IndenterPlace{any[i], Vec3::UnitZ()},
        IndenterPlace{any[i] + 0.2 * any[i + 1], Vec3(0.2, 0, 1).normalized()}};
    const std::array<Vec3, 2> point{any[i] + any[i + 2], any[i] + any[i + 3]};
    const auto gap = [&](double gone) {
      const IndenterPlace now{(1 - gone) * places[0].centre + gone * places[1].centre,
                              ((1 - gone) * places[0].normal + gone * places[1].normal).normalized()};
      return gap_to(shape, now, (1 - gone) * point[0] + gone * point[1]).distance;
    };
    if (gap(0) < 0 || gap(1) < 0) continue;
    double least = 1;
    for (int step = 0; step <= 1000; ++step) least = std::min(least, gap(step / 1000.0));
    if (least > -1.3 * deep && least < near - deep) continue;  // it grazes
    EXPECT_EQ(goes_through(shape, places, point), least < -deep) << least;
    ++(least < -deep ? through : past);
  }
  EXPECT_GT(through, 10);
  EXPECT_GT(past, 10);
}

INSTANTIATE_TEST_SUITE_P(Indenters, ShapeOf,
                         ::testing::Values(IndenterShape{false, 0.008, 0.008},
                                           IndenterShape{true, 0.012, 0.004},
                                           IndenterShape{true, 0.006, 0.006}));

class PushedBy : public ::testing::TestWithParam<std::string> {
 protected:
  PushedBy()
      : body_(low_box()),
        scene_(scene_of(GetParam())),
        problem_{body_, materials_of_parts(scene_, body_), {}} {
    problem_.models = models_of_parts(scene_, body_);
    scene_.get<Supports>().ties.clear();
  }

  Body body_;
  Scene scene_;
  Problem problem_;
};

// As deep as a solution has it, where the tangent is whole: along any direction, forces against the energy's difference and
// the stiffness against theirs.
TEST_P(PushedBy, ForcesAndStiffnessAreDerivatives) {
  Mechanics mechanics(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::stored);
  const State state{any_vectors(body_.element_count(), 3e-5), 1};
  ASSERT_LT(deepest(scene_, body_, state), 0.01);
  std::optional<Indenters> made = Indenters::make(scene_.get<Indenters>(), problem_);
  ASSERT_TRUE(made);
  std::vector<Vec3> pushed(body_.element_count(), Vec3::Zero());
  made->add_forces(state, pushed);
  ASSERT_GT(made->energy(state), 0) << "it touches";
  const std::vector<Vec3> along = any_vectors(body_.element_count(), 1);
  const double step = 1e-8;
  State more = state, less = state;
  for (std::size_t e = 0; e < along.size(); ++e) {
    more.displacement[e] += step * along[e];
    less.displacement[e] -= step * along[e];
  }
  const auto dot = [&](const std::vector<Vec3>& forces) {
    double sum = 0;
    for (std::size_t e = 0; e < forces.size(); ++e) sum += forces[e].dot(along[e]);
    return sum;
  };
  EXPECT_NEAR(-(made->energy(more) - made->energy(less)) / (2 * step), dot(pushed),
              1e-5 * std::abs(dot(pushed)));
  mechanics.assemble(state);
  std::vector<Vec3> expected;
  multiply(mechanics.tangent(), along, expected);
  const std::vector<Vec3> up = mechanics.forces(more).total, down = mechanics.forces(less).total;
  double off = 0, size = 0;
  for (std::size_t e = 0; e < along.size(); ++e) {
    off += ((down[e] - up[e]) / (2 * step) - expected[e]).squaredNorm();
    size += expected[e].squaredNorm();
  }
  EXPECT_LT(std::sqrt(off / size), 1e-5);
}

// Of all points of the surface, without patches.
TEST_P(PushedBy, NoPointIsPassedOver) {
  std::optional<Indenters> made = Indenters::make(scene_.get<Indenters>(), problem_);
  ASSERT_TRUE(made);
  std::vector<std::uint32_t> polygons(body_.surface.polygon_count());
  std::iota(polygons.begin(), polygons.end(), 0U);
  const Indenter& tool = scene_.get<Indenters>().indenters[0];
  for (const double share : {0.0, 0.5, 1.0, 20.0}) {
    const State state{any_vectors(body_.element_count(), 2e-3), share};
    double energy = 0;
    for (const SurfacePoint& point : surface_points(problem_, polygons)) {
      Vec3 now = point.position;
      for (std::uint32_t a = 0; a < point.at.count; ++a)
        now += point.at.weights[a] * state.displacement[point.at.elements[a]];
      const double depth = std::max(0.0, -gap_to(tool.shape, tool.at(share), now).distance), soft = 1e-4;
      energy += 2000 * kGumYoung / 0.01 * point.area_vector.norm() *
                (depth < soft ? depth * depth * depth / (6 * soft)
                              : depth * depth / 2 - soft * depth / 2 + soft * soft / 6);
    }
    EXPECT_NEAR(made->energy(state), energy, 1e-12 * energy) << share;
  }
}

// The matrix that has cells made and effects stored has a place for all that an indenter may push at.
TEST_P(PushedBy, TheTangentThatIsMadeIsTheOneThatIsStored) {
  if (problem_.models.at(0) == Model::springs) GTEST_SKIP() << "is stored";
  Mechanics stored(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::stored),
      made(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::made);
  ASSERT_NE(dynamic_cast<const CellStiffness*>(&made.tangent()), nullptr) << "it is stored after all";
  State state{any_vectors(body_.element_count(), 2e-3), 20};
  for (Mechanics* each : {&stored, &made}) each->assemble(state);
  std::vector<Vec3> expected, found;
  const std::vector<Vec3> x = any_vectors(body_.element_count(), 1);
  multiply(stored.tangent(), x, expected);
  multiply(made.tangent(), x, found);
  for (std::size_t e = 0; e < expected.size(); ++e)
    EXPECT_LT((expected[e] - found[e]).norm(), 1e-9 * 2000 * kGumYoung * 0.01);
}

// The cells' tangent of one state with what the indenter adds in another.
TEST_P(PushedBy, WhatItAddsIsMadeAnewAlone) {
  Mechanics both(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::stored);
  const State first{any_vectors(body_.element_count(), 1e-3), 1},
      then{any_vectors(body_.element_count(), 2e-3), 20};
  both.assemble(first);
  EXPECT_FALSE(both.renew_effects(then)) << "it is stored together with the rest";
  if (problem_.models.at(0) == Model::springs) return;
  Mechanics made(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::made);
  const std::vector<Vec3> x = any_vectors(body_.element_count(), 1);
  std::vector<Vec3> before, after, added, taken;
  made.assemble(first);
  multiply(made.tangent(), x, before);
  ASSERT_TRUE(made.renew_effects(then));
  multiply(made.tangent(), x, after);
  multiply(StoredMatrix(made.stiffness_of_effects(then)), x, added);
  multiply(StoredMatrix(made.stiffness_of_effects(first)), x, taken);
  double most = 0;
  for (std::size_t e = 0; e < x.size(); ++e) {
    EXPECT_LT((after[e] - before[e] - added[e] + taken[e]).norm(), 1e-9 * 2000 * kGumYoung * 0.01) << e;
    most = std::max(most, (after[e] - before[e]).norm());
  }
  EXPECT_GT(most, 1e-3 * kGumYoung * 0.01);
}

INSTANTIATE_TEST_SUITE_P(Indenters, PushedBy,
                         ::testing::Values(ball(Vec3(0.021, 0.018, 0.032), 0.012, Vec3(0, 0, -5e-5)),
                                           ball(Vec3(0.021, 0.018, 0.032), 0.012, Vec3(0, 0, -5e-5)) +
                                               "[parts.box]\nmodel = \"springs\"\n",
                                           plate(Vec3(0.021, 0.018, 0.020), 0.013, Vec3(0, 0, -5e-5))));

class SymmetricPush : public ::testing::TestWithParam<std::string> {};

TEST_P(SymmetricPush, GivesASymmetricShapeInBalance) {
  Body body = box_body({.cells = {12, 12, 6}, .spacing = Vec3::Constant(0.005)});
  const SimulateResult result = solve(body, kOnTheGround + GetParam());
  ASSERT_EQ(result.reactions.size(), 2u);
  const Reaction &ground = result.reactions[0], &tool = result.reactions[1];
  EXPECT_LT(tool.force.z(), -1);
  EXPECT_LT((ground.force + tool.force).norm(), 1e-6 * tool.force.norm());
  EXPECT_LT((ground.moment + tool.moment).norm(), 1e-6 * tool.force.norm() * 0.03);
  EXPECT_LT(std::hypot(tool.force.x(), tool.force.y()), 1e-6 * tool.force.norm());
  EXPECT_THAT(warnings(body, kOnTheGround + GetParam()), IsEmpty());
  EXPECT_GT(deepest(scene_of(kOnTheGround + GetParam()), body, state_of(body)), 0);
  std::map<std::array<std::int32_t, 3>, Vec3> moved;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    moved[body.lattice_index[e]] = body.position[e] - body.rest[e];
  double lowest = 0;
  for (const auto& [at, u] : moved) {
    lowest = std::min(lowest, u.z());
    const Vec3& mirrored = moved.at({12 - at[0], at[1], at[2]});
    EXPECT_LT((Vec3(-u.x(), u.y(), u.z()) - mirrored).norm(), 1e-9);
    const Vec3& turned = moved.at({at[1], at[0], at[2]});
    EXPECT_LT((Vec3(u.y(), u.x(), u.z()) - turned).norm(), 1e-9);
  }
  // nodes are a chord's height or two below where facets touch
  EXPECT_LT(lowest, -0.0039);
  EXPECT_GT(lowest, -0.0049);
}

INSTANTIATE_TEST_SUITE_P(Indenters, SymmetricPush,
                         ::testing::Values(ball(Vec3(0.03, 0.03, 0.045), 0.015, Vec3(0, 0, -0.004)),
                                           ball(Vec3(0.03, 0.03, 0.045), 0.015, Vec3(0, 0, -0.004)) +
                                               "[parts.box]\nmodel = \"springs\"\n",
                                           plate(Vec3(0.03, 0.03, 0.031), 0.014, Vec3(0, 0, -0.0048))));

// A quarter of a block, six radii of contact wide and high. Its ground is at rest where a half space would have gone by
// F (1 + nu) (3 - 2 nu) / (2 pi E H) under the ball (Boussinesq).
TEST(Indenters, ABallResistsAsHertzHasIt) {
  if (sanitized()) GTEST_SKIP() << "ABallDoesNotPassThroughAPart goes the same ways through memory";
  constexpr int kContact = 3, kWide = 18;
  constexpr double kSpacing = 1e-3, kRadius = 0.03, kPoisson = 0.3;
  const double depth = std::pow(kContact * kSpacing, 2) / kRadius, height = kWide * kSpacing;
  Body body = box_body({.cells = {kWide, kWide, kWide}, .spacing = Vec3::Constant(kSpacing)});
  const std::string text =
      kOnTheGround +
      "[[fix]]\nwhere = \"box/x0\"\naxes = \"x\"\n[[fix]]\nwhere = \"box/y0\"\naxes = \"y\"\n" +
      ball(Vec3(0, 0, height + kRadius), kRadius, Vec3(0, 0, -depth));
  const SimulateResult result = solve(body, text);
  const double force = -4 * result.reactions.back().force.z();
  const double far =
      force * (1 + kPoisson) * (3 - 2 * kPoisson) / (2 * std::numbers::pi * kGumYoung * height);
  const double hertz =
      4.0 / 3 * kGumYoung / (1 - kPoisson * kPoisson) * std::sqrt(kRadius * std::pow(depth + far, 3));
  EXPECT_NEAR(force / hertz, 1, 0.1);
  EXPECT_THAT(warnings(body, text), IsEmpty());
}

// A ball that is led by more than its diameter in one scene stays on its side, and so does one that begins far away.
TEST(Indenters, ABallDoesNotPassThroughAPart) {
  for (const double away : {0.0, 0.1}) {
    Body body = box_body({.cells = {16, 4, 2}, .spacing = Vec3::Constant(0.005)});
    const SimulateResult result =
        solve(body, "[[fix]]\nwhere = \"box/x0\"\n" +
                        ball(Vec3(0.055, 0.01, 0.016 + away), 0.006, Vec3(0, 0, -0.03 - away)));
    EXPECT_LT(result.reactions[1].force.z(), 0);
    for (std::size_t e = 0; e < body.element_count(); ++e)
      if (body.lattice_index[e] == Index3{11, 2, 2}) {
        EXPECT_LT(body.position[e].z(), -0.017);
      }
    EXPECT_GT(result.load_steps, 9);
  }
}

// So does one at rest that the part is led onto, by more than its diameter: it pushes as where the part comes little by
// little.
TEST(Indenters, APartDoesNotPassThroughABall) {
  const std::string onto =
      "[[fix]]\nwhere = \"box/x0\"\n[[move]]\nwhere = \"box/x1\"\ndisplacement = [0, 0, \"-30 mm\"]\n" +
      ball(Vec3(0.04, 0.01, -0.008), 0.006, Vec3::Zero());
  std::vector<double> pushed;
  for (const std::string how : {"", "[run]\nload_steps = 40\n"}) {
    Body body = box_body({.cells = {16, 4, 2}, .spacing = Vec3::Constant(0.005)});
    pushed.push_back(solve(body, how + onto).reactions.back().force.z());
  }
  EXPECT_GT(pushed[1], 10);
  EXPECT_NEAR(pushed[0], pushed[1], 1e-4 * pushed[1]);
}

// A load by a rigid link presses a bar against a ball as one that is spread evenly does, and nothing buckles.
TEST(Indenters, ARigidLinkPressesAsALoadDoes) {
  std::vector<double> pushed;
  for (const std::string link : {"averaging", "rigid"}) {
    Body body = box_body({.cells = {16, 4, 2}, .spacing = Vec3::Constant(0.005)});
    pushed.push_back(solve(body,
                           "[[fix]]\nwhere = \"box/x0\"\n[[load]]\nwhere = \"box/x1\"\nforce = [0, 0, "
                           "\"0.1 N\"]\nlink = \"" +
                               link + "\"\n" + ball(Vec3(0.06, 0.01, 0.017), 0.006, Vec3::Zero()))
                         .reactions.back()
                         .force.z());
  }
  EXPECT_LT(pushed[0], -0.05);
  EXPECT_NEAR(pushed[1], pushed[0], 0.02 * std::abs(pushed[0]));
}

// Without friction a plate that is turned pushes along its face's normal.
TEST(Indenters, APlateTurnsAndPushesAlongItsNormal) {
  Body body = box_body({.cells = {8, 8, 4}, .spacing = Vec3::Constant(0.005)});
  const SimulateResult result =
      solve(body, kOnTheGround + plate(Vec3(0.02, 0.02, 0.023), 0.05, Vec3(0, 0, -0.005)) +
                      "rotation = { axis = [0, 1, 0], through = [\"20 mm\", \"20 mm\", \"21 mm\"], angle = "
                      "\"5 deg\" }\n");
  const Vec3 normal = Eigen::AngleAxisd(5 * std::numbers::pi / 180, Vec3::UnitY()) * -Vec3::UnitZ();
  EXPECT_LT(result.reactions[1].force.normalized().cross(normal).norm(), 1e-3);
}

TEST(Indenters, WhatTouchesNothingOrTooDeepIsSaid) {
  Body body = low_box();
  const std::string text = kOnTheGround + ball(Vec3(0.02, 0.02, 0.04), 0.01, Vec3(0, 0, -0.011));
  EXPECT_THAT(warnings(body, text),
              ElementsAre(HasSubstr("\"tool\" has the surface up to 9 % of a cell inside")));
  (void)solve(body, kOnTheGround + ball(Vec3(0.02, 0.02, 0.04), 0.01, Vec3(0, 0, -0.001)));
  EXPECT_THAT(warnings(body, kOnTheGround + ball(Vec3(0.02, 0.02, 0.04), 0.01, Vec3(0, 0, -0.001))),
              ElementsAre(HasSubstr("\"tool\" touches nothing")));
}

TEST(Indenters, WayClearIsWhereTheSurfaceEnds) {
  const Body body = low_box();
  const Scene scene = scene_of("");
  const Problem problem{body, materials_of_parts(scene, body), {}};
  const IndenterShape shape{false, 0.012, 0.012};
  const auto way = way_clear(shape, {Vec3(0.02, 0.02, 0.025)}, Vec3::UnitZ(), problem, {});
  ASSERT_TRUE(way);
  EXPECT_NEAR(*way, 0.007, 1e-4);
  EXPECT_EQ(*way_clear(shape, {Vec3(0.02, 0.02, 0.05)}, Vec3::UnitZ(), problem, {}), 0);
}

TEST(Indenters, WhatCannotBeIsRefused) {
  using testing::refusal;
  const auto why = [](const std::string& text, const std::string& top = "") {
    try {
      return refusal(low_box(), parse_scene(top + kGum + text, "s.toml"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
  };
  const std::string good = ball(Vec3(0.02, 0.02, 0.032), 0.012, Vec3(0, 0, -1e-3));
  EXPECT_EQ(why(kOnTheGround + good), "accepted");
  EXPECT_THAT(why("[run]\ntime = \"1 s\"\n" + kOnTheGround + good), HasSubstr("acts at equilibrium only"));
  EXPECT_THAT(why(kOnTheGround + good, "contact = true\n"), HasSubstr("acts at equilibrium only"));
  EXPECT_THAT(why("[run]\nmodes = 2\n" + kOnTheGround + good),
              HasSubstr("has no indenters (1 [[indenter]])"));
  EXPECT_THAT(why(kOnTheGround + good, "model = \"quadratic\"\n"),
              HasSubstr("it has no indenters (1 [[indenter]])"));
  EXPECT_THAT(why(kOnTheGround + ball(Vec3(0.02, 0.02, 0.031), 0.012, Vec3::Zero())),
              HasSubstr("begins inside part \"box\""));
  EXPECT_THAT(why(kOnTheGround + ball(Vec3(0.02, 0.02, 0.026), 0.005, Vec3::Zero())),
              HasSubstr("less than a cell"));
  EXPECT_THAT(why(kOnTheGround + ball(Vec3(0.02, 0.02, 2e4), 1e4 + 1, Vec3::Zero())),
              HasSubstr("more than a million cells"));
  EXPECT_THAT(why(kOnTheGround + ball(Vec3(0.02, 0.02, 0.032), 0.012, Vec3(0, 0, -1e10))),
              HasSubstr("takes more than 10,000 of them"));
  EXPECT_THAT(why(kOnTheGround + "[[indenter]]\nplate = { centre = [0, 0, \"30 mm\"], normal = [0, 0, -1], "
                                 "radius = \"10 mm\", rounding = \"0.9 mm\" }\n"),
              HasSubstr("less than a tenth of a cell"));
  EXPECT_THAT(why(good), HasSubstr("nothing holds part \"box\""));
  EXPECT_THAT(why("[[fix]]\nwhere = \"box/z0\"\naxes = \"xy\"\n" + good),
              HasSubstr("free to translate along z"));
  EXPECT_THAT(why(kOnTheGround + "[[indenter]]\nname = \"tool\"\n"), HasSubstr("needs either \"ball\""));
  EXPECT_THAT(
      why(kOnTheGround + plate(Vec3(0.02, 0.02, 0.03), 0.01, Vec3::Zero()) +
          "rotation = { axis = [0, 0, 1], through = [0, 0, 0], angle = \"1 rad\", arc_from = [\"1 mm\", 0, "
          "0] }\n"),
      HasSubstr("arc_from"));
  Body carved = low_box();
  carved.notes[kCarvedNote] = "";
  EXPECT_THAT(refusal(carved, scene_of(kOnTheGround + good)), HasSubstr("carved out"));
}

// A ball within a part large enough touches no surface, and begins inside all the same.
TEST(Indenters, ABallWithinAPartBeginsInside) {
  const Body body = box_body({.cells = {8, 8, 8}, .spacing = Vec3::Constant(0.01)});
  EXPECT_THAT(
      testing::refusal(body, scene_of(kOnTheGround + ball(Vec3(0.04, 0.04, 0.04), 0.012, Vec3::Zero()))),
      HasSubstr("begins inside part \"box\""));
}

TEST(Indenters, ModelPaperIsRefused) {
  EXPECT_THAT(testing::refusal(testing::centre_body({.voxels = {4, 4, 4}, .spacing = 0.01}),
                               scene_of("[[fix]]\nwhere = \"zmin\"\n" +
                                        ball(Vec3(0.02, 0.02, 0.07), 0.012, Vec3(0, 0, -1e-3)))),
              HasSubstr("model \"paper\" does not have"));
}

}  // namespace
}  // namespace flexel::simulate
