// References, errors, the frontier and the sentences of a study, on numbers that are known.
#include "flexel/study/accuracy_analysis.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>

#include "base/error.h"
#include "flexel/study/runs/surfaces.h"

namespace flexel::study {
namespace {

std::vector<study::SizeValue> sequence(double limit, double factor, double order, std::vector<double> sizes) {
  std::vector<study::SizeValue> values;
  for (const double h : sizes) values.push_back({h, limit + factor * std::pow(h, order)});
  return values;
}

// Two triangles in mm: of the same vertices, along the one diagonal or the other.
std::string square(const std::string& name, double height, const std::string& triangles) {
  std::string path = ::testing::TempDir() + name;
  std::ofstream(path)
      << "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
         "property double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
      << fmt::format("0 0 {0}\n10 0 {0}\n10 10 {0}\n0 10 {0}\n", height) << triangles;
  return path;
}

TEST(StudyMeasure, DistancesOfSurfacesAreOfOneMesh) {
  const std::string one = "3 0 1 2\n3 0 2 3\n", other = "3 0 1 3\n3 1 2 3\n";
  const std::string low = square("study-low.ply", 0, one), high = square("study-high.ply", 0.5, one),
                    across = square("study-across.ply", 0.5, other);
  const Deadline late = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  EXPECT_NEAR(surface_distance(high, low, late).rms, 0.5e-3, 1e-12);
  try {
    (void)surface_distance(across, low, late);
    FAIL() << "points of other triangles are compared";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--edge"), std::string::npos) << error.what();
  }
}

TEST(StudyMeasure, RichardsonFindsTheLimitAndTheOrder) {
  for (const double order : {0.8, 1.0, 1.5, 2.0})
    for (const double sign : {-1.0, 1.0}) {
      const study::Reference found =
          extrapolate("tip", "m", sequence(5, sign * 0.3, order, {4, 3, 2, 1.5, 1}));
      EXPECT_NEAR(found.value, 5, 1e-6) << order;
      ASSERT_TRUE(found.order);
      EXPECT_NEAR(*found.order, order, 1e-6);
      EXPECT_GE(found.uncertainty, std::abs(0.3 * 0.2));  // a quarter of the finest error at least: honest
    }
}

TEST(StudyMeasure, ValuesThatSwingHaveNoOrderAndAWideUncertainty) {
  const study::Reference found = extrapolate("tip", "m", {{4, 1.0}, {2, 1.2}, {1, 1.1}});
  EXPECT_FALSE(found.order);
  EXPECT_DOUBLE_EQ(found.value, 1.1);
  EXPECT_NEAR(found.uncertainty, 0.6, 1e-12);
}

TEST(StudyMeasure, FewerSizesAreSaidToBeFewer) {
  EXPECT_DOUBLE_EQ(extrapolate("tip", "m", {{1, 2.0}}).uncertainty, 2);
  const study::Reference two = extrapolate("tip", "m", {{2, 2.0}, {1, 2.1}});
  EXPECT_DOUBLE_EQ(two.value, 2.1);
  EXPECT_NEAR(two.uncertainty, 0.3, 1e-12);
}

// The extrapolation that a finer run moves far is not sure, however even the last three look.
TEST(StudyMeasure, AnExtrapolationThatMovesIsUncertain) {
  const std::vector<study::SizeValue> values = {{8, 9.0}, {4, 6.0}, {2, 5.10}, {1, 5.09}};
  const study::Reference found = extrapolate("tip", "m", values);
  const study::Reference before = extrapolate("tip", "m", {values.begin(), values.end() - 1});
  EXPECT_GE(found.uncertainty, 0.5 * std::abs(found.value - before.value));
}

// Cells close in with order 2: an order of 5 is chance, and the finest two say nothing of the limit.
TEST(StudyMeasure, OrdersThatCellsDoNotHaveAreNotBelieved) {
  // 13 % below the truth of 1, though the last two differ by half a percent.
  const std::vector<study::SizeValue> values = {{4, 0.72}, {3, 0.865}, {2.5, 0.87}};
  const study::Reference found = extrapolate("tip", "m", values);
  EXPECT_FALSE(found.order);
  EXPECT_DOUBLE_EQ(found.value, 0.87);
  EXPECT_GE(found.uncertainty, 0.13);
  EXPECT_NE(found.from.find("faster than cells"), std::string::npos);
  EXPECT_FALSE(found.doubt.empty());  // 50 % is no reference
  for (const double order : {2.3, 2.9}) {
    const study::Reference near = extrapolate("tip", "m", sequence(5, 0.3, order, {4, 2, 1}));
    ASSERT_TRUE(near.order);
    EXPECT_LE(std::abs(near.value - 5), near.uncertainty);
  }
  EXPECT_FALSE(extrapolate("tip", "m", sequence(5, 0.3, 4.8, {4, 2, 1})).order);
}

TEST(StudyMeasure, SizesCoarserThanTheWallsCarryNoReference) {
  std::vector<study::SizeValue> values = sequence(5, 0.3, 2, {8, 4, 2, 1, 0.5});
  values[0].value = values[1].value = -20;  // they would spoil it
  values[0].resolved = values[1].resolved = false;
  const study::Reference found = extrapolate("tip", "m", values);
  EXPECT_NEAR(found.value, 5, 1e-9);
  EXPECT_TRUE(found.doubt.empty());
  values[2].resolved = false;
  const study::Reference none = extrapolate("tip", "m", values);
  EXPECT_FALSE(none.order);
  EXPECT_DOUBLE_EQ(none.value, values.back().value);
  EXPECT_NE(none.doubt.find("only 2 of 5 sizes"), std::string::npos) << none.doubt;
}

TEST(StudyMeasure, WithoutAReferenceThereIsNoErrorButARange) {
  study::Reference tip = extrapolate("tip", "m", {{4, 1e-3, false}, {2, 1.4e-3, false}, {1, 2e-3, false}});
  EXPECT_TRUE(doubtful_sentences({tip}).empty());  // it does not decide
  tip.decides = true;
  study::RunResult run;
  run.quantities = {{"tip", "m", 2e-3}};
  EXPECT_FALSE(error_of(run, {tip}));
  const std::vector<std::string> said = doubtful_sentences({tip});
  ASSERT_EQ(said.size(), 3u);
  EXPECT_EQ(
      said[0],
      "The error of no run is known: only 0 of 3 sizes have two cells or more through the walls, and three "
      "are needed.");
  EXPECT_EQ(said[1], "tip: 2 mm by the finest size; it may be anything from 200 um to 3.8 mm.");
  tip.doubt.clear();
  EXPECT_TRUE(doubtful_sentences({tip}).empty());
  EXPECT_TRUE(error_of(run, {tip}));
}

TEST(StudyMeasure, TheBarOfASizeHoldsTheLimit) {
  const std::vector<study::SizeValue> values = sequence(5, 0.3, 2, {4, 2, 1, 0.5});
  for (std::size_t n = 2; n <= values.size(); ++n) {
    const double half = half_range({values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n)});
    EXPECT_GE(half, std::abs(values[n - 1].value - 5)) << n;
    EXPECT_LE(half, 4 * std::abs(values[n - 1].value - 5) + 9) << n;
  }
  EXPECT_DOUBLE_EQ(half_range({values[0]}), values[0].value);
}

study::RunResult run_with(std::vector<Quantity> quantities) {
  study::RunResult run;
  run.quantities = std::move(quantities);
  return run;
}

TEST(StudyMeasure, TheWorstDecidingQuantityIsTheError) {
  std::vector<study::Reference> references(3);
  references[0] = {"a", "m", 2, 0.002, std::nullopt, "", true, ""};
  references[1] = {"b", "m", -1, 0.02, std::nullopt, "", true, ""};
  references[2] = {"c", "m", 1, 9, std::nullopt, "", false, ""};
  const study::RunResult run = run_with({{"a", "m", 2.2}, {"b", "m", -0.95}, {"c", "m", 50}});
  EXPECT_NEAR(error_of(run, references)->error, 0.1, 1e-12);
  EXPECT_NEAR(error_of(run, references)->uncertainty, 0.02, 1e-12);
  EXPECT_FALSE(error_of(run_with({{"d", "m", 1}}), references));
}

study::Point point(double seconds, double error, double uncertainty = 0,
                   const std::string& sweep = "resolution") {
  study::Point result;
  result.sweep = sweep;
  result.options = "--size " + std::to_string(static_cast<int>(100 * seconds));
  result.seconds = seconds;
  result.memory = 420e6;
  result.error = study::RunError{error, uncertainty};
  return result;
}

TEST(StudyMeasure, NothingOnTheFrontierIsBeaten) {
  std::vector<study::Point> points;
  for (int i = 0; i < 60; ++i)
    points.push_back(point(0.1 + std::fmod(i * 0.618, 1.0), 0.001 + std::fmod(i * 0.414, 1.0)));
  points[7].choosable = false;
  points[8].error.reset();
  const std::vector<std::size_t> front = frontier(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool on = std::count(front.begin(), front.end(), i) > 0;
    bool beaten = !points[i].choosable || !points[i].error;
    for (std::size_t j = 0; j < points.size() && !beaten; ++j)
      beaten = points[j].choosable && points[j].error && points[j].seconds < points[i].seconds &&
               points[j].error->error <= points[i].error->error;
    EXPECT_NE(on, beaten) << i;
  }
}

TEST(StudyMeasure, TheUncertaintyCountsAgainstATarget) {
  const std::vector<study::Point> points = {point(1, 0.009, 0.002), point(2, 0.007, 0.002),
                                            point(3, 0.001, 0.002)};
  EXPECT_EQ(*cheapest_within(points, 0.01), 1u);
  EXPECT_FALSE(cheapest_within(points, 0.002));
}

TEST(StudyMeasure, TenfoldIsThePowerOfTheSweep) {
  std::vector<study::Point> points;
  for (const double h : {4.0, 2.0, 1.0, 0.5}) points.push_back(point(std::pow(h, -3), 0.01 * h * h));
  EXPECT_NEAR(*cost_of_tenfold(points), std::pow(10, 1.5), 1e-9);
  points.push_back(point(1000, 0.5, 0, "model"));  // other curves do not count
  points.push_back(point(1000, 0.001, 0.01));      // nor what is not known
  EXPECT_NEAR(*cost_of_tenfold(points), std::pow(10, 1.5), 1e-9);
  EXPECT_FALSE(cost_of_tenfold({point(1, 0.1)}));
  EXPECT_FALSE(cost_of_tenfold({point(1, 0.1), point(2, 0.09)}));
  EXPECT_FALSE(cost_of_tenfold({point(1, 0.01), point(2, 0.1)}));
}

TEST(StudyMeasure, TheSentence) {
  std::vector<study::Point> points = {point(0.5, 0.08), point(3.1, 0.008), point(60, 0.0009)};
  const std::vector<std::string> said = sentences(points);
  ASSERT_EQ(said.size(), 2u);
  EXPECT_EQ(said[0], "For 1 % use --size 310: 3.1 s, 420 MB.");
  // The slope of (log 1/error, log time) is 1.064, and 10^1.064 = 11.6.
  EXPECT_EQ(said[1].substr(0, 32), "Ten times the accuracy costs 12 ");
  for (study::Point& each : points) each.error->uncertainty = 0.03;
  const std::vector<std::string> unsure = sentences(points);
  EXPECT_EQ(unsure[0],
            "No run is known to be within 1 %; the best is --size 6000: 0.09 % off, give or take 3 %.");
  EXPECT_EQ(unsure[1], "For 5 % use --size 310: 3.1 s, 420 MB.");
}

TEST(StudyMeasure, TheMedianIsKnownWhenItRepeats) {
  EXPECT_DOUBLE_EQ(median({3, 1, 2}).value, 2);
  EXPECT_DOUBLE_EQ(median({4, 1, 2, 3}).value, 2.5);
  EXPECT_TRUE(std::isinf(median({1, 1}).relative_error));
  EXPECT_DOUBLE_EQ(median({1, 1, 1}).relative_error, 0);
  EXPECT_GT(median({1, 2, 3}).relative_error, 0.05);
  EXPECT_LT(median({1, 1.01, 0.99, 1}).relative_error, 0.05);
}

TEST(StudyMeasure, LengthsAndTimesForPeople) {
  EXPECT_EQ(option_length(1.5e-3), "1.5mm");
  EXPECT_EQ(option_length(7.5e-4), "750um");
  EXPECT_EQ(option_length(0.0333333), "33.3mm");
  EXPECT_EQ(human_seconds(0.0123), "12 ms");
  EXPECT_EQ(human_seconds(3.14), "3.1 s");
  EXPECT_EQ(human_seconds(250), "4 min 10 s");
}

TEST(StudyMeasure, AnotherProgramAgreesWhereTheRangesMeet) {
  const study::Reference ours = extrapolate("tip", "m", sequence(5, 0.3, 2, {4, 2, 1}));
  const Agreement same = compare(ours, sequence(5, -0.2, 2, {3, 2, 1}));
  EXPECT_TRUE(same.agree);
  EXPECT_NEAR(same.theirs.value, 5, 1e-6);
  EXPECT_DOUBLE_EQ(same.finest, 4.8);
  const double apart = ours.uncertainty + same.theirs.uncertainty;
  EXPECT_TRUE(compare(ours, sequence(5 + 0.99 * apart, -0.2, 2, {3, 2, 1})).agree);
  EXPECT_FALSE(compare(ours, sequence(5 + 1.01 * apart, -0.2, 2, {3, 2, 1})).agree);
  EXPECT_FALSE(compare(ours, {}).agree);
}

TEST(StudyMeasure, AnotherProgramsSentenceIsOfItsOwnPoints) {
  study::Point ours{"1 mm", "resolution", "--size 1mm", 1, 1e8, study::RunError{0.001, 0.001}};
  study::Point coarse{
      "CalculiX 5 mm", "calculix", "edges of 5mm", 2, 1e8, study::RunError{0.03, 0.001}, false};
  study::Point fine{
      "CalculiX 3 mm", "calculix", "edges of 3mm", 8, 3e8, study::RunError{0.004, 0.001}, false};
  EXPECT_EQ(against_sentence({ours}), "");
  EXPECT_EQ(against_sentence({ours, coarse}),
            "For 5 % CalculiX takes edges of 5mm: 2.0 s with meshing, 100 MB.");
  EXPECT_EQ(against_sentence({ours, coarse, fine}),
            "For 1 % CalculiX takes edges of 3mm: 8.0 s with meshing, 300 MB.");
  coarse.error->error = 0.9;
  EXPECT_NE(against_sentence({coarse}).find("No run of CalculiX"), std::string::npos);
  // It is on no frontier of ours and no answer of ours.
  EXPECT_EQ(frontier({ours, fine}).size(), 1u);
  EXPECT_EQ(sentences({fine}).front().find("No run tells an error"), 0u);
}

}  // namespace
}  // namespace flexel::study
