// Buckling, large rotation and snap-through against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::gum_scene;
using testing::kGumYoung;

SimulateResult find_equilibrium(Body& body, const Scene& scene) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = options.stress = false;
  return simulate(body, scene, options, progress);
}

// A square bar of `thick` cells across and `slender` times as long, 1 m long,
// held at x = 0.
struct Slender {
  int thick = 4, slender = 20;
  [[nodiscard]] double side() const { return 1.0 / slender; }
  [[nodiscard]] double bending() const { return kGumYoung * std::pow(side(), 4) / 12; }  // E I
  [[nodiscard]] double euler() const { return M_PI * M_PI * bending() / 4; }  // P L^2 / (E I) = pi^2 / 4
};

Body column(const Slender& bar) {
  return testing::box_body({.cells = {bar.slender * bar.thick, bar.thick, bar.thick},
                            .spacing = Vec3::Constant(bar.side() / bar.thick)});
}

// PrescribedMotion at x = 0, `force` on the free end, whose mean displacement is probed.
Scene held(const Vec3& force) {
  Scene scene = gum_scene(0);
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("xmin")));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("xmax"), force));
  Probe probe;
  probe.where = select_by_name("xmax");
  scene.probes.push_back(probe);
  return scene;
}

Vec3 tip_displacement(const Slender& bar, const Vec3& force) {
  Body body = column(bar);
  return find_equilibrium(body, held(force)).probes[0].displacement;
}

// A column with an axial load P and a small one across bends by 3 (tan x - x) /
// x^3 times what the small one does alone, x = pi/2 sqrt(P / Pcr) (Timoshenko
// and Gere 1961, section 1.3).
TEST(LargeDeflection, ColumnsCriticalLoad) {
  const Slender bar;
  const double across = 1e-6 * bar.euler(), axial = 0.9 * bar.euler();
  const double ratio =
      tip_displacement(bar, Vec3(-axial, 0, across)).z() / tip_displacement(bar, Vec3(0, 0, across)).z();
  double low = 0.1, high = M_PI / 2 - 1e-9;
  for (int i = 0; i < 60; ++i) {
    const double x = 0.5 * (low + high);
    (3 * (std::tan(x) - x) / (x * x * x) < ratio ? low : high) = x;
  }
  const double critical = axial * std::pow(M_PI / 2 / low, 2);
  EXPECT_NEAR(critical / bar.euler(), 1, 0.03);
}

// A load along its axis alone may leave a column straight, beyond its critical load too: one line or another tells it.
TEST(LargeDeflection, AStraightColumnThatWouldBuckleIsToldSo) {
  const Slender bar{2, 15};
  for (const char* model : {"cells", "springs"})
    for (const double share : {0.7, 2.0}) {
      Body body = column(bar);
      Scene scene = held(Vec3(-share * bar.euler(), 0, 0));
      scene.parts[body.parts[0].name].model = model;
      ::testing::internal::CaptureStderr();
      (void)find_equilibrium(body, scene);
      const std::string said = ::testing::internal::GetCapturedStderr();
      EXPECT_EQ(said.find("the part buckles") != std::string::npos, share > 1) << model << share << said;
    }
}

// Past it: the elastica of a column at P = 1.152 Pcr, whose end has turned by 60 degrees, gone 0.593 L aside
// and come 0.259 L nearer (Timoshenko and Gere 1961, table 2-4). Led aside by that much it needs no force
// aside.
TEST(LargeDeflection, ColumnAfterBuckling) {
  const Slender bar;
  Body body = column(bar);
  Scene scene = held(Vec3(-1.152 * bar.euler(), 0, 0));
  Selection middle;
  middle.kind = Selection::Kind::box;
  middle.min = Vec3(1 - 1e-6, -1, bar.side() / 2 - 1e-6);
  middle.max = Vec3(1 + 1e-6, 1, bar.side() / 2 + 1e-6);
  Tie aside = make_move(middle, Vec3(0, 0, 0.593));
  aside.axes = {false, false, true};
  scene.get<Supports>().ties.push_back(aside);
  const SimulateResult result = find_equilibrium(body, scene);
  EXPECT_NEAR(result.reactions[1].force.z() / bar.euler(), 0, 0.02);
  EXPECT_NEAR(-result.probes[0].displacement.x(), 0.259, 0.005);
}

// F L^2 / (E I) = 10: down by 0.81061 L, in by 0.55500 L (Mattiasson 1981).
TEST(LargeDeflection, CantileverToFourFifthsOfItsLength) {
  const Slender bar{less_if_sanitized(4, 2, "two cells through the thickness"), 40};
  const Vec3 moved = tip_displacement(bar, Vec3(0, 0, -10 * bar.bending()));
  EXPECT_NEAR(-moved.z() / 0.81061, 1, 0.005);
  EXPECT_NEAR(-moved.x() / 0.55500, 1, 0.005);
}

struct Snap {
  double force = 0, energy = 0;
};

// A shallow arch 60 x 2.5 cells with a rise of 8, held at both ends; its crown
// is led down.
Snap crown_led_by(double down) {
  constexpr int kThick = 3, kRise = 6, kSpan = 60;
  const auto fill = [](int i, int, int k) {
    const double x = 2 * (i + 0.5) / kSpan - 1;
    const auto low = static_cast<int>(std::lround(kRise * (1 - x * x)));
    return k >= low && k < low + kThick ? 1.0 : 0.0;
  };
  Body body = testing::box_body({.cells = {60, 1, 9}, .spacing = Vec3::Constant(0.01), .fill = fill});
  Scene scene = gum_scene(0);
  const auto beyond = [](double x, double side) {
    Selection selection;
    selection.kind = Selection::Kind::half_space;
    selection.point = Vec3(x, 0, 0);
    selection.normal = Vec3(side, 0, 0);
    return selection;
  };
  scene.get<Supports>().ties.push_back(make_fix(beyond(0.001, -1)));
  scene.get<Supports>().ties.push_back(make_fix(beyond(0.599, 1)));
  Selection crown;
  crown.kind = Selection::Kind::box;
  crown.min = Vec3(0.299, -1, -1);
  crown.max = Vec3(0.301, 1, 1);
  Tie lead = make_move(crown, Vec3(0, 0, -down));
  lead.axes = {true, false, true};
  scene.get<Supports>().ties.push_back(lead);
  Tie plane = make_fix(select_by_name("box"));  // one cell wide, it would leave its plane first
  plane.axes = {false, true, false};
  scene.get<Supports>().ties.push_back(plane);
  scene.run.load_steps = 4;
  const SimulateResult result = find_equilibrium(body, scene);
  return {-result.reactions[2].force.z(), result.elastic_energy};
}

// A bar of enough cells to start from a coarser lattice, and the same in two load steps, which do not.
TEST(LargeDeflection, TheStartDoesNotShow) {
  const Slender bar{.thick = 6, .slender = 20};
  Scene scene = held(Vec3(0, 0, -3 * bar.bending()));
  scene.run.tolerance = 1e-9;
  Body body = column(bar);
  const SimulateResult once = find_equilibrium(body, scene);
  EXPECT_EQ(once.load_steps, 1);
  EXPECT_LE(once.newton_iterations, 5) << "not from a coarser lattice";
  // what error bars allow their own coarse runs
  EXPECT_GT(once.start_newton_iterations, once.newton_iterations);
  scene.run.load_steps = 2;
  Body again = column(bar);
  const SimulateResult twice = find_equilibrium(again, scene);
  EXPECT_EQ(twice.load_steps, 2);
  const Vec3 tip = twice.probes[0].displacement;
  EXPECT_GT(tip.norm(), 0.5);
  EXPECT_LT((once.probes[0].displacement - tip).norm(), 1e-6 * tip.norm());
}

// The force rises to a limit, falls and turns round: the arch would snap. It is
// the slope of the energy all the way.
TEST(LargeDeflection, ArchIsFollowedPastItsLimitPoint) {
  double most = 0, least = 1e300;
  for (const double down : {0.01, 0.03, 0.06, 0.09}) {
    const double step = 2e-4;
    const Snap before = crown_led_by(down - step), at = crown_led_by(down), after = crown_led_by(down + step);
    most = std::max(most, at.force);
    if (at.force < most) least = std::min(least, at.force);
    EXPECT_NEAR((after.energy - before.energy) / (2 * step), at.force, 0.01 * most) << down;
  }
  EXPECT_LT(least, 0.8 * most);
}

// A whole turn is one, and not none: load steps go along the arc, and the energy does not depend on how it was cut. The bar
// stays straight, as one of four cells across does.
TEST(LargeDeflection, AWholeTurnIsFollowed) {
  const auto turned = [](double angle, int load_steps) {
    Body body = testing::box_body({.cells = {1, 1, 6}, .spacing = Vec3::Constant(0.01)});
    Scene scene = gum_scene(0);
    scene.materials["gum"].poisson = 0.25;
    scene.get<Supports>().ties.push_back(make_fix(select_by_name("zmin")));
    Tie turn = make_move(select_by_name("zmax"), Vec3::Zero());
    turn.motion.through = Vec3(0.005, 0.005, 0);
    turn.motion.angle = angle;
    scene.get<Supports>().ties.push_back(turn);
    scene.run.load_steps = load_steps;
    const SimulateResult result = find_equilibrium(body, scene);
    Vec3 middle = Vec3::Zero();
    for (std::size_t e = 12; e < 16; ++e) middle += 0.25 * body.position[e];
    const double aside = (middle - Vec3(0.005, 0.005, 0.03)).head<2>().norm();
    return std::pair{result.elastic_energy, aside};
  };
  const auto [half, straight] = turned(M_PI, 1);
  EXPECT_LT(straight, 1e-6);
  const auto [whole, aside] = turned(2 * M_PI, 1);
  EXPECT_GT(whole, 2 * half);
  EXPECT_LT(whole, 5 * half);
  EXPECT_LT(aside, 1e-6);
  EXPECT_NEAR(turned(2 * M_PI, 32).first / whole, 1, 1e-6);
}

}  // namespace
}  // namespace flexel::simulate
