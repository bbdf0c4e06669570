// Error bars: the arithmetic on sequences whose limit is known, and whole runs against references.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "simulate/estimate.h"
#include "tests/simulate/study_beam.h"

namespace flexel {
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

TEST(ErrorBars, TheStressAtAClampHasNone) {
  const SimulateResult result = end_loaded(testing::corner_beam(16), testing::held_beam("cells"));
  ASSERT_TRUE(result.error_bars.von_mises.has_value()) << result.error_bars.note;
  EXPECT_EQ(result.error_bars.von_mises->value[0], result.stress->value);
  EXPECT_GT(result.error_bars.von_mises->value[0], result.error_bars.von_mises->value[1]);
  EXPECT_FALSE(result.error_bars.von_mises->bar.has_value());
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
}  // namespace flexel
