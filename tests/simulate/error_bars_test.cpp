// Error bars: the arithmetic on sequences whose limit is known, and whole runs against references.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "base/stop.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fields.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/estimate/stress_singularity.h"
#include "simulate/result/estimate.h"
#include "tests/sanitized.h"
#include "tests/scratch.h"
#include "tests/simulate/study_beam.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

Sequence power_law(double limit, double factor, double order, double first_ratio, double second_ratio) {
  const auto at = [&](double h) { return limit + factor * std::pow(h, order); };
  return {{at(1), at(first_ratio), at(first_ratio * second_ratio)}, {first_ratio, second_ratio}};
}

TEST(Richardson, FindsOrderAndLimitOfAPowerLaw) {
  for (const double order : {0.7, 1.0, 1.5, 2.0})
    for (const double second : {2.0, 1.8, 2.3}) {
      const Bar bar = richardson(power_law(3, -0.2, order, 2, second));
      ASSERT_TRUE(bar.order);
      EXPECT_NEAR(*bar.order, order, 1e-6);
      EXPECT_NEAR(bar.extrapolated, 3, 1e-6);
      EXPECT_NEAR(bar.half_width, 1.25 * 0.2, 1e-5);
    }
}

TEST(Richardson, UnevenSequencesGetWideBars) {
  const Bar zigzag = richardson({{1.0, 1.1, 0.9}, {2, 2}});
  EXPECT_FALSE(zigzag.order);
  EXPECT_NEAR(zigzag.half_width, 0.6, 1e-12);
  EXPECT_EQ(zigzag.extrapolated, 1);
  EXPECT_FALSE(richardson({{1.0, 1.2, 1.21}, {2, 2}}).order);  // moves away
  EXPECT_EQ(richardson({{2, 2, 2}, {2, 2}}).half_width, 0);
}

TEST(Richardson, SuddenArrivalKeepsWhatOrderTwoWouldLeave) {
  const Bar bar = richardson({{1.0, 1.01, 1.5}, {2, 2}});
  EXPECT_GT(*bar.order, 3);
  EXPECT_NEAR(bar.half_width, 0.49 / 4, 1e-12);
  // Just above order 2 the two differences agree: three times the distance, which is the whole difference.
  const Bar near = richardson({{1.0, 1.01, 1.055}, {2, 2}});
  EXPECT_GT(*near.order, 2.1);
  EXPECT_NEAR(near.half_width, 0.45 / 40, 1e-12);
}

SimulateResult end_loaded(Body body, Scene scene) {
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(0, 0, testing::kStudyForce)));
  Probe tip;
  tip.name = "tip";
  tip.where = select_by_name("box/x1");
  scene.probes.push_back(tip);
  return testing::simulate_quietly(body, scene);
}

// Of h, 2h, 4h.
Sequence stresses(const std::function<double(double)>& at) {
  return {{at(1), at(2), at(4)}, {2, 2}};
}

// Of model `quadratic`: the larger of what the lattices and what the field itself leaves open.
TEST(StressBar, OfAFieldIsTheLargestDoubt) {
  EXPECT_NEAR(field_stress_bar({{5, 5.2, 5.4}, {2, 2}}, 3, 0.1, false)->half_width, 0.2, 1e-12);
  EXPECT_NEAR(field_stress_bar({{5, 5.2, 8.2}, {2, 2}}, 3, 0.1, false)->half_width, 0.75, 1e-12);
  EXPECT_NEAR(field_stress_bar({{5, 5.2, 5.4}, {2, 2}}, 3, 0.9, false)->half_width, 1.35, 1e-12);
  EXPECT_NEAR(field_stress_bar({{5, 5.2, 5.2}, {2, 2}}, 2, 0.1, false)->half_width, 0.6, 1e-12);
  EXPECT_NEAR(field_stress_bar({{5, 4.8, 4.7}, {2, 2}}, 3, 0.1, false)->half_width, 0.45, 1e-12);  // grows
  EXPECT_NEAR(field_stress_bar({{5, 4.8, 4.5}, {2, 2}}, 3, 0.1, false)->half_width, 0.2, 1e-12);   // settles
  EXPECT_NEAR(field_stress_bar({{5, 4.8, 4.9}, {2, 2}}, 3, 0.1, false)->half_width, 0.2, 1e-12);
  EXPECT_FALSE(field_stress_bar({{5, 4.8, 4.4}, {2, 2}}, 3, 0, true).has_value());
  EXPECT_TRUE(field_stress_bar({{5, 5.001, 5.003}, {2, 2}}, 3, 0, true).has_value());
}

// A peak that cells of h begin to see, 1 / (1 + (h / r)^2) of 1: the bar holds it wherever the notch is wider than a cell.
TEST(StressBar, OfAFieldHoldsAPeakThatBeginsToShow) {
  using Ratio = std::array<double, 2>;
  for (const Ratio& ratio : {Ratio{2, 2}, Ratio{1.5, 1.5}, Ratio{1.5, 2}, Ratio{1.5, 3}, Ratio{1.75, 2},
                             Ratio{2, 1.5}, Ratio{3, 2}})
    for (double h = 0.05; h < 1; h *= 1.1) {
      const auto peak = [&](double cell) { return 1 / (1 + cell * cell); };
      const double value = peak(h);
      const Sequence seen{{value, peak(ratio[0] * h), peak(ratio[0] * ratio[1] * h)}, ratio};
      const auto bar = field_stress_bar(seen, 3, 0, false);
      EXPECT_GE(bar->half_width, 1 - value) << h << ", ratios " << ratio[0] << " and " << ratio[1];
      EXPECT_LE(bar->half_width, (ratio == Ratio{2, 2} ? 5 : 9) * (1 - value))
          << h << ", ratios " << ratio[0] << " and " << ratio[1];
    }
}

TEST(StressBar, HoldsTheLimitOrThereIsNone) {
  const auto smooth = stress_bar(stresses([](double h) { return 5 + 0.1 * h; }));
  ASSERT_TRUE(smooth.has_value());
  EXPECT_NEAR(smooth->extrapolated, 5, 1e-9);
  EXPECT_NEAR(smooth->half_width, 0.3, 1e-9);
  // Beside a crack, a right re-entrant angle (Williams 1952), a clamped edge
  for (const double power : {0.5, 0.456, 0.2})
    EXPECT_FALSE(stress_bar(stresses([&](double h) { return std::pow(h, -power); })).has_value()) << power;
  EXPECT_FALSE(stress_bar({{5, 6, 5}, {2, 2}}).has_value());
  const auto same = stress_bar({{5, 5.001, 5}, {2, 2}});
  ASSERT_TRUE(same.has_value());
  EXPECT_NEAR(same->half_width, 0.003, 1e-9);
}

// A twisted square bar of 4, 2 and 1 cells across, whose limit is 83.3 (Saint-Venant): the first two are alike by chance.
TEST(StressBar, DoesNotTrustASuddenArrival) {
  const auto bar = stress_bar({{63.4, 59.0, 17.9}, {2, 2}});
  ASSERT_TRUE(bar.has_value());
  EXPECT_GT(bar->half_width, 83.3 - 63.4);
  // Of order 2, and a little above it, nothing changes.
  EXPECT_NEAR(stress_bar(stresses([](double h) { return 5 + 0.1 * h * h; }))->half_width, 0.3, 1e-9);
}

// What flat faces make of coarser cells no option of flexel-voxelize changes: the note gives none.
TEST(ErrorBars, CellsOfSpringsThatWouldBeNoCubesAreToldSo) {
  const SimulateResult result = end_loaded(testing::corner_beam(5), testing::held_beam("springs"));
  EXPECT_THAT(result.error_bars.note, HasSubstr("would be no cubes"));
  EXPECT_THAT(result.error_bars.note, ::testing::Not(HasSubstr("--align")));
  EXPECT_FALSE(end_loaded(testing::corner_beam(4), testing::held_beam("springs")).error_bars.bars.empty());
}

// They make the displacement a first guess, whatever the coarser cells would be besides.
TEST(ErrorBars, ThinWallsOfSpringsAreToldBeforeUnevenCubes) {
  const Body plate =
      testing::box_body({.cells = {25, 10, 2}, .fill = [](int, int, int k) { return k == 0 ? 1 : 0.5; }});
  EXPECT_THAT(end_loaded(plate, testing::held_beam("springs")).error_bars.note,
              HasSubstr("walls are thinner than two cells"));
}

// Coarse cells put the largest stress some way from the clamp, where three values may seem to close in.
TEST(ErrorBars, TheStressAtAClampHasNoneAtAnySpacing) {
  for (const int n : less_if_sanitized<std::vector<int>>({6, 8, 12, 16}, {6, 8}, "two spacings of four")) {
    const SimulateResult result = end_loaded(testing::corner_beam(n), testing::held_beam("cells"));
    ASSERT_TRUE(result.error_bars.von_mises.has_value()) << result.error_bars.note;
    EXPECT_EQ(result.error_bars.von_mises->value[0], result.stress->value);
    EXPECT_EQ(result.stress->beside, "a support") << n;
    EXPECT_FALSE(result.error_bars.von_mises->bar.has_value()) << n;
  }
}

// Two facets that meet in the edge from (0, 0, 0) to (0, 1, 0): the floor z = 0 at x < 0, seen from above,
// and a slope of `degrees` at x > 0, which rises from it (a re-entrant edge) or falls.
Body facets(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const Vec3 up(std::cos(angle), 0, std::sin(angle));
  Body body;
  Surface& surface = body.surface;
  // Each with vertices of its own.
  surface.vertices = {Vec3(-1, 0, 0),     Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(-1, 1, 0), Vec3(0, 0, 0), up,
                      up + Vec3(0, 1, 0), Vec3(0, 1, 0)};
  surface.polygon_offsets = {0, 4, 8};
  surface.polygon_vertices = {0, 1, 2, 3, 4, 5, 6, 7};
  return body;
}

TEST(StressSingularity, IsAReentrantEdgeOrASupport) {
  const Vec3 near(-0.2, 0.5, 0), far(-0.6, 0.5, 0);
  EXPECT_EQ(singular_beside(facets(90), {}, near, 0.3), "a re-entrant edge");
  EXPECT_EQ(singular_beside(facets(90), {}, far, 0.3), "");
  EXPECT_EQ(singular_beside(facets(-90), {}, near, 0.3), "");  // convex
  EXPECT_EQ(singular_beside(facets(10), {}, near, 0.3), "");   // a facet of a fillet
  Body body = facets(-90);
  body.rest = {Vec3(-0.1, 0.5, 0), Vec3(-0.7, 0.5, 0)};
  EXPECT_EQ(singular_beside(body, {1, 2}, near, 0.3), "");  // 1: slides
  EXPECT_EQ(singular_beside(body, {2, 0}, near, 0.3), "a support");
}

TEST(ErrorBars, HoldTheCantileversReference) {
  for (const int n : {4, 8}) {
    const SimulateResult result = end_loaded(testing::corner_beam(n), testing::held_beam("cells"));
    const double reference = testing::study_reference(testing::study_width(n)) * testing::kStudyForce;
    ASSERT_EQ(result.error_bars.bars.size(), 3u) << result.error_bars.note;
    const ErrorBar& tip = result.error_bars.bars[0];
    EXPECT_EQ(tip.name(), "probe tip");
    EXPECT_LT(std::abs(tip.value - reference), tip.bar.half_width) << n;
    EXPECT_LT(tip.bar.half_width, 0.2 * reference);
    const ErrorBar& energy = result.error_bars.bars[2];
    EXPECT_LT(std::abs(energy.value - 0.5 * testing::kStudyForce * reference), energy.bar.half_width);
  }
}

TEST(ErrorBars, SayWhyThereAreNone) {
  Body plate = testing::box_body({.cells = {8, 8, 1}, .spacing = Vec3::Constant(0.25)});
  const SimulateResult thin = end_loaded(plate, testing::held_beam("cells"));
  EXPECT_TRUE(thin.error_bars.bars.empty());
  EXPECT_THAT(thin.error_bars.note, HasSubstr("one cell thick"));
  Body beam = testing::box_body({.cells = {16, 2, 2}, .spacing = Vec3::Constant(0.125)});
  const SimulateResult coarse = end_loaded(beam, testing::held_beam("cells"));
  EXPECT_EQ(coarse.error_bars.bars.size(), 3u);
  EXPECT_THAT(coarse.error_bars.note, HasSubstr("four times as coarse"));
}

TEST(ErrorBars, ATimeLimitInThemLosesNoEquilibrium) {
  Body beam = testing::corner_beam(4);
  Scene scene = testing::held_beam("cells");
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(0, 0, 1)));
  std::optional<StopAfter> limit;
  int searches = 0;
  LoadStepHooks hooks;
  hooks.make_solver = [&](Mechanics&) {
    if (++searches == 2) limit.emplace(0, "--timeout");  // on the lattice twice as coarse
    return LoadStepSolver();
  };
  SimulateOptions options;
  options.hooks = std::make_shared<const LoadStepHooks>(hooks);
  const flexel::test::Scratch scratch;
  options.failed_output = scratch.path("failed.vtu");
  Progress progress("test", Progress::Mode::quiet);
  try {
    (void)simulate(beam, scene, options, progress);
    FAIL() << "no time limit";
  } catch (const TimeoutError& error) {
    EXPECT_THAT(error.what(), HasSubstr("in the error bars; the equilibrium is in "));
  }
  limit.reset();
  const Body kept = read_body(options.failed_output);
  EXPECT_GT(largest_displacement(kept).value(), 1e-9);
  EXPECT_EQ(kept.position, beam.position);
}

// By 16 % with two cells through it and with one.
TEST(ErrorBars, OfABarTwistedWithTwoCellsThroughItAreWide) {
  for (const int length : {8, 20}) {
    Body bar = testing::box_body({.cells = {length, 2, 2}, .spacing = Vec3::Constant(0.25)});
    Scene scene = testing::held_beam("cells");
    Load twist = make_push(select_by_name("box/x1"), Vec3::Zero());
    twist.force.reset();
    twist.torque = Vec3(testing::kStudyForce, 0, 0);
    scene.get<Loads>().loads.push_back(twist);
    const SimulateResult result = testing::simulate_quietly(bar, scene);
    const ErrorBar& energy = result.error_bars.bars.back();
    // Saint-Venant's torsion constant of a square: 0.1406 a^4 (Timoshenko and Goodier 1970, section 109).
    const double shear = testing::kStudyYoung / 2 / (1 + testing::kStudyPoisson);
    const double long_bar =
        0.5 * std::pow(testing::kStudyForce, 2) * 0.25 * length / (0.1406 * std::pow(0.5, 4) * shear);
    EXPECT_LT(energy.value, 0.9 * long_bar);
    EXPECT_LT(std::abs(energy.value - long_bar), energy.bar.half_width);
    EXPECT_THAT(result.error_bars.note, HasSubstr("at least 20 % of the value"));
  }
}

TEST(ErrorBars, AreLeftOutWhenNotAskedFor) {
  Body beam = testing::corner_beam(2);
  Scene scene = testing::held_beam("cells");
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(0, 0, 1)));
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = false;
  const SimulateResult result = simulate(beam, scene, options, progress);
  EXPECT_TRUE(result.error_bars.bars.empty());
  EXPECT_TRUE(result.error_bars.note.empty());
}

}  // namespace
}  // namespace flexel::simulate
