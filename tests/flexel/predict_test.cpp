// What the next run will take: laws that are met exactly, and laws with noise within a factor 1.5.
#include "flexel/study/predict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "flexel/study/sweep.h"

namespace flexel::study {
namespace {

TEST(Predict, ALawWithoutNoiseIsFound) {
  for (const double power : {1.0, 1.1, 1.25}) {
    const study::PowerLaw law{0.2, 3e-5, power};
    std::vector<study::Observation> seen;
    for (const double x : {1e3, 4e3, 16e3, 64e3}) seen.push_back({x, law.at(x)});
    // The prior is wrong by factors of 3 and 4, and draws a little.
    const study::PowerLaw found = fit(seen, {0.6, 12e-5, 1.05}, true);
    EXPECT_NEAR(found.at(200e3) / law.at(200e3), 1, 0.1) << power;
  }
}

TEST(Predict, WithoutObservationsThePriorHolds) {
  const study::PowerLaw prior{0.1, 2e-6, 1};
  EXPECT_EQ(fit({}, prior, true).at(1e5), prior.at(1e5));
}

TEST(Predict, OneObservationScalesThePrior) {
  const study::PowerLaw found = fit({{1e4, 5.0}}, {0.1, 5e-5, 1}, true);  // the prior says 0.6
  EXPECT_NEAR(found.at(1e4), 5.0, 0.3);
  EXPECT_GT(found.at(4e4), 12);  // it grows
}

TEST(Predict, NothingIsEverNegative) {
  const study::PowerLaw found = fit({{1e3, 1.0}, {1e4, 0.9}, {1e5, 0.8}}, {0, 1e-5, 1}, true);
  EXPECT_GE(found.constant, 0);
  EXPECT_GE(found.slope, 0);
}

study::RunResult run_at(double cells, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.1);
  study::RunResult run;
  for (const char* stage : kStages) run.stages.push_back({stage, 0.02 * std::exp(noise(random))});
  for (study::Stage& stage : run.stages) {
    if (stage.name == "assemble") stage.wall = 1e-5 * cells * std::exp(noise(random));
    if (stage.name == "solve") stage.wall = (0.01 + 3e-5 * std::pow(cells, 1.08)) * std::exp(noise(random));
    if (stage.name == "voxelize")
      stage.wall = (0.05 + 1e-4 * std::pow(cells, 0.67)) * std::exp(noise(random));
    run.wall += stage.wall;
  }
  run.program_memory = {80e6 + 100 * cells, 30e6 + 4300 * cells, 18e6 + 400 * cells};
  return run;
}

double largest(const std::array<double, 3>& values) {
  return *std::max_element(values.begin(), values.end());
}

// Every stage with a noise of 10 %: a few runs in a thousand lie beyond.
TEST(Predict, TheNextRunOfASweepIsWithinAFactor) {
  std::mt19937 random(7);
  int runs = 0, beyond = 0;
  for (int trial = 0; trial < 100; ++trial) {
    study::Predictor predictor;
    for (double cells = 500; cells < 1.1e6; cells *= 2.5) {
      const study::RunResult run = run_at(cells, random);
      const study::Prediction told = predictor.predict("", {cells});
      if (cells > 1e4) {
        const double time = std::abs(std::log(told.seconds / run.wall));
        const double memory = std::abs(std::log(told.bytes / largest(run.program_memory)));
        EXPECT_LT(time, std::log(2.0)) << cells;
        EXPECT_LT(memory, std::log(1.5)) << cells;
        ++runs;
        beyond += time > std::log(1.5);
      }
      predictor.add("", {cells}, run);
    }
  }
  EXPECT_LT(beyond, runs / 100);
}

TEST(Predict, AnotherKindStartsFromTheOrdinaryOne) {
  std::mt19937 random(3);
  study::Predictor predictor;
  for (const double cells : {1e3, 1e4}) predictor.add("", {cells}, run_at(cells, random));
  EXPECT_EQ(predictor.predict("springs", {3e4}).seconds, predictor.predict("", {3e4}).seconds);
  study::RunResult slow = run_at(1e4, random);
  for (study::Stage& stage : slow.stages) stage.wall *= 4;
  predictor.add("springs", {1e4}, slow);
  EXPECT_NEAR(predictor.predict("springs", {2e4}).seconds / predictor.predict("", {2e4}).seconds, 4, 1);
}

TEST(Predict, StepsCountInTimedRuns) {
  study::Predictor predictor;
  for (const double cells : {1e3, 4e3}) {
    study::RunResult run;
    const double steps = 100 * std::cbrt(cells);
    for (const char* stage : kStages) run.stages.push_back({stage, 0.01});
    for (study::Stage& stage : run.stages)
      if (stage.name == "assemble") stage.wall = 0.01 + 5e-8 * cells * steps;
    predictor.add("", {cells, steps}, run);
  }
  const double steps = 100 * std::cbrt(64e3);
  EXPECT_NEAR(predictor.predict("", {64e3, steps}).seconds, 0.09 + 5e-8 * 64e3 * steps, 3);
}

// Stages that a kind does not have cost it nothing, and a direct solver's memory grows faster than its cells.
TEST(Predict, CalculixAndOneProcessHaveLawsOfTheirOwn) {
  for (const double power : {1.2, 1.45, 1.7}) {
    study::Predictor predictor;
    const auto run_at = [&](double cells) {
      study::RunResult run;
      run.stages = {{"voxelize", 0.3 + 1e-4 * cells}, {"solve", 3e-6 * std::pow(cells, power)}};
      run.program_memory = {70e6 + 2000 * cells, 25e6 + 500 * std::pow(cells, 1.3), 0};
      return run;
    };
    for (const double cells : {400.0, 1400.0, 5000.0, 17000.0})
      predictor.add(kCalculix, {cells, 1}, run_at(cells));
    const study::RunResult next = run_at(60e3);
    const study::Prediction told = predictor.predict(kCalculix, {60e3, 1});
    EXPECT_NEAR(std::log(told.seconds / (next.stages[0].wall + next.stages[1].wall)), 0, std::log(1.5))
        << power;
    EXPECT_NEAR(std::log(told.bytes / largest(next.program_memory)), 0, std::log(1.5)) << power;
  }
  study::Predictor predictor;
  for (const double cells : {2e3, 16e3, 60e3}) {
    study::RunResult run;
    run.stages = {{"voxelize", 0.03 + 1e-6 * cells},
                  {"solve", 2e-5 * cells},
                  {"error bars", 1e-5 * cells},
                  {"map", 0.05}};
    run.program_memory[0] = 100e6 + 5000 * cells;
    predictor.add(kOneProcess, {cells, 1}, run);
  }
  const study::Prediction told = predictor.predict(kOneProcess, {250e3, 1});
  EXPECT_NEAR(told.seconds / (0.08 + 31e-6 * 250e3), 1, 0.25);
  EXPECT_NEAR(told.bytes / (100e6 + 5000 * 250e3), 1, 0.1);
}

// 1.2 s of a run's work are done by one thread, 4 s by both: 3.2 s on two threads, 5.2 s on one.
TEST(Predict, ARunOnOneThreadTakesTheWorkOfAll) {
  study::Sweep sweep(study::SceneFacts{}, study::Configuration{}, {2e-3, 1e-3}, 100, 2);
  bool found = false;
  for (int rounds = 0; rounds < 60 && !found; ++rounds)
    for (const study::Trial& trial : sweep.open()) {
      if (trial.label.find("1 thread") == std::string::npos) {
        study::RunResult run;
        run.cells = trial.configuration.size < 1.5e-3 ? 80000 : 10000;
        const double scale = static_cast<double>(run.cells) / 80000;
        run.stages = {{"solve", 3.2 * scale}};
        run.wall = 3.2 * scale;
        run.cpu = 5.2 * scale;
        sweep.done(trial, run);
        break;
      }
      found = true;
      study::Trial on_two = trial;
      on_two.configuration.threads = 2;
      EXPECT_NEAR(sweep.predict(trial).seconds / sweep.predict(on_two).seconds, 5.2 / 3.2, 1e-9);
    }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace flexel::study
