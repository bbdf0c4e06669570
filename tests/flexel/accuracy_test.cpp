// The choice of a resolution, on runs that are made up: a value that approaches its limit as c h^p.
#include "flexel/accuracy/resolution_search.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/stop.h"
#include "flexel/accuracy/run_error.h"

namespace flexel::commands {
namespace {

// A cube of side 1 m whose vertex moves by value(h), with `per_cell` seconds a cell.
SolveAt made_up(const std::function<double(double)>& value, double per_cell = 1e-6) {
  return [=](std::optional<double> size, const GoesOn& goes_on) {
    SolvedRun run;
    run.size = size.value_or(0.08);
    Part part;
    part.name = "cube";
    part.lattice.spacing = Vec3::Constant(run.size);
    run.voxels.body.parts.push_back(part);
    run.voxels.body.cell_elements.resize(static_cast<std::size_t>(std::pow(1 / run.size, 3)));
    run.given_up = size && !goes_on(run.voxels.body.cell_count());
    if (run.given_up) return run;
    run.mapped = {Vec3(0, 0, value(run.size)), Vec3(0, 0, 0.1)};
    run.simulated.seconds = per_cell * static_cast<double>(run.voxels.body.cell_count());
    return run;
  };
}

AccuracyReport choose(const SolveAt& solve, std::optional<double> error, double within = 3) {
  AccuracyGoal goal;
  goal.error = error;
  goal.within = within;
  goal.began = std::chrono::steady_clock::now();
  AccuracyReport report;
  Progress silent("", Progress::Mode::silent);
  const SolvedRun last = choose_resolution(goal, solve, report, silent);
  EXPECT_EQ(last.size, report.runs.back().size);
  return report;
}

TEST(Accuracy, ReachesWhatWasAskedForAndSaysNoLessThanTheTrueError) {
  for (const double order : {1.0, 1.5, 2.0})
    for (const double wrong : {-3.0, 0.5, 5.0}) {
      const auto value = [&](double h) { return 1 + wrong * std::pow(h, order); };
      const AccuracyReport report = choose(made_up(value), 0.02);
      const TriedRun& last = report.runs.back();
      const double true_error = std::abs(1 / value(last.size) - 1);
      ASSERT_TRUE(last.error.has_value());
      EXPECT_GE(*last.error, 0.99 * true_error) << order << ' ' << wrong;
      if (report.met()) {
        EXPECT_LE(true_error, 0.02);
      }
      EXPECT_TRUE(report.met() || !report.stopped.empty()) << report.sentence();
    }
}

TEST(Accuracy, ValuesThatJumpAreNotTrusted) {
  int count = 0;
  const auto value = [&](double) { return ++count % 2 ? 1.0 : 1.2; };
  const AccuracyReport report = choose(made_up(value), 0.02);
  EXPECT_FALSE(report.met());
  EXPECT_NE(report.sentence().find("NOT the 2 % asked for"), std::string::npos) << report.sentence();
}

// Walls of one to two cells: two coarse lattices that happen to agree, 13 % from the limit (the fork of the
// real parts did so). An order far above the model's own is no order.
TEST(Accuracy, ValuesThatCloseInTooFastAreNotTrusted) {
  const SolveAt solve = made_up([](double h) { return h > 0.06 ? 3.88 : h > 0.03 ? 4.858 : 4.898; });
  std::vector<SolvedRun> runs;
  for (const double size : {0.08, 0.04, 0.025}) runs.push_back(solve(size, [](std::size_t) { return true; }));
  const std::optional<Judged> judged = judge(runs, Quantities(false));
  ASSERT_TRUE(judged.has_value());
  EXPECT_GT(judged->error, 0.05);
}

TEST(Accuracy, ProbesCountWhereThereAreSome) {
  const SolveAt solve = made_up([](double h) { return 1 + std::log(h); });  // a vertex that has no limit
  const SolveAt with_probe = [&](std::optional<double> size, const GoesOn& goes_on) {
    SolvedRun run = solve(size, goes_on);
    run.simulated.probes.emplace_back();
    run.simulated.probes.back().name = "tip";
    run.simulated.probes.back().displacement = Vec3(0, 1 + run.size * run.size, 0);
    return run;
  };
  const AccuracyReport report = choose(with_probe, 0.02);
  EXPECT_TRUE(report.met());
  EXPECT_EQ(report.runs.back().of, "probe tip");
  EXPECT_FALSE(choose(solve, 0.02).met());
}

TEST(Accuracy, WithinIsTheFinestThatFits) {
  const auto value = [](double h) { return 1 + h; };
  const AccuracyReport report = choose(made_up(value, 1e-4), std::nullopt, 20);
  // The runs take no time of their own: about 0.85 x 20 s at 1e-4 s a cell
  EXPECT_LT(report.runs.back().seconds, 20);
  EXPECT_GT(report.runs.back().seconds, 8);
}

TEST(Accuracy, WhereTheErrorIsOutOfReachMoreTimeIsAdvisedAndGetsFiner) {
  const SolveAt slow = made_up([](double h) { return 1 + 3 * std::sqrt(h); }, 1e-4);
  const AccuracyReport report = choose(slow, 0.001, 20);
  EXPECT_FALSE(report.met());
  int minutes = 0;
  ASSERT_EQ(std::sscanf(report.advice.c_str(), "--within %dmin makes a finer run", &minutes), 1)
      << report.advice;
  EXPECT_LE(choose(slow, 0.001, 60.0 * minutes).runs.back().size, 0.6 * report.runs.back().size);
  // ten minutes would not do either
  EXPECT_EQ(choose(slow, 0.001, 600).advice, "");
}

// A wall that is cut once more below a size has twice the cells there: counted before anything is solved.
TEST(Accuracy, ALatticeWithMoreCellsThanThoughtIsGivenUp) {
  const SolveAt smooth = made_up([](double h) { return 1 + h; }, 1e-4);
  int solved = 0, made = 0;
  const SolveAt cut_once_more = [&](std::optional<double> size, const GoesOn& goes_on) {
    ++made;
    const bool twice = size && *size < 0.03;
    SolvedRun run = smooth(size, [&](std::size_t cells) { return goes_on(twice ? 2 * cells : cells); });
    if (twice) {
      run.voxels.body.cell_elements.resize(2 * run.voxels.body.cell_count());
      run.simulated.seconds *= 2;
    }
    solved += size && !run.given_up;
    return run;
  };
  const AccuracyReport report = choose(cut_once_more, std::nullopt, 20);
  EXPECT_GT(made, solved + 1);  // the first lattice is never solved
  EXPECT_LT(report.runs.back().seconds, 20);
  EXPECT_GT(report.runs.back().seconds, 8);
}

TEST(Accuracy, SizesAreThoseThatAreSaid) {
  const AccuracyReport report = choose(made_up([](double h) { return 1 + h; }), 0.02);
  EXPECT_NE(report.sentence().find("--size"), std::string::npos);
  for (const TriedRun& run : report.runs)
    EXPECT_NEAR(run.size, std::stod(fmt::format("{:.3g}", run.size)), 1e-12);
}

TEST(Accuracy, SizesThatCannotBeSolvedAreLeftOut) {
  const SolveAt solve = made_up([](double h) { return 1 + h * h; });
  const SolveAt picky = [&](std::optional<double> size, const GoesOn& goes_on) {
    if (size && *size > 0.05) throw InputError("too coarse");
    return solve(size, goes_on);
  };
  const AccuracyReport report = choose(picky, 0.02);
  EXPECT_EQ(report.runs.front().failure, "too coarse");
  EXPECT_TRUE(report.met());
  EXPECT_THROW(choose(
                   [](std::optional<double> size, const GoesOn& goes_on) -> SolvedRun {
                     if (size) throw InputError("never");
                     return made_up([](double) { return 1.0; })(size, goes_on);
                   },
                   0.02),
               InputError);
}

// The same runs with error bars of their own: `share` of the value at spacing h, of order 1.
SolveAt with_bars(const SolveAt& solve, const std::function<double(double)>& share) {
  return [=](std::optional<double> size, const GoesOn& goes_on) {
    SolvedRun run = solve(size, goes_on);
    if (run.mapped.empty()) return run;
    simulate::ErrorBar bar;
    bar.of = simulate::ErrorBar::Of::largest_displacement;
    bar.value = run.mapped[0].z();
    bar.bar = {share(run.size) * std::abs(bar.value), bar.value, 1.0};
    run.simulated.error_bars.bars.push_back(bar);
    return run;
  };
}

struct ChosenRun {
  SolvedRun last;
  AccuracyReport report;
};

ChosenRun choose_by_default(const SolveAt& solve, double error = 0.05, double within = 20) {
  AccuracyGoal goal;
  goal.by_default = true;
  goal.error = error;
  goal.within = within;
  goal.began = std::chrono::steady_clock::now();
  ChosenRun chosen;
  Progress silent("", Progress::Mode::silent);
  chosen.last = choose_resolution(goal, solve, chosen.report, silent);
  return chosen;
}

TEST(PreferredNumbers, AreNearAndStayWhatTheyAre) {
  EXPECT_DOUBLE_EQ(preferred_number(0.00117, 20, Rounded::nearest), 0.00112);
  EXPECT_DOUBLE_EQ(preferred_number(0.00101, 10, Rounded::up), 0.00125);
  EXPECT_DOUBLE_EQ(preferred_number(9.6, 20, Rounded::nearest), 10);
  for (double value = 1e-6; value < 1e3; value *= 1.037) {
    const double near = preferred_number(value, 20, Rounded::nearest),
                 up = preferred_number(value, 10, Rounded::up);
    EXPECT_NEAR(near / value, 1, 0.07) << value;
    EXPECT_GE(up, value * (1 - 1e-6));
    EXPECT_LE(up, value * 1.29);
    EXPECT_EQ(preferred_number(near, 20, Rounded::nearest), near) << value;
    EXPECT_EQ(preferred_number(up, 10, Rounded::up), up) << value;
  }
}

TEST(UsualSize, ANarrowBarIsEnough) {
  const auto value = [](double h) { return 1 + h; };
  EXPECT_EQ(choose_by_default(with_bars(made_up(value), [](double) { return 0.03; })).report.runs.size(), 1u);
  const AccuracyReport wide =
      choose_by_default(with_bars(made_up(value), [](double h) { return 3 * h; })).report;
  EXPECT_GT(wide.runs.size(), 1u);
  EXPECT_LE(*wide.runs.back().error, 0.05);
  EXPECT_TRUE(wide.met());
}

TEST(UsualSize, AFinerTargetIsNoCoarserAndMoreTimeIsNoCoarser) {
  const SolveAt solve =
      with_bars(made_up([](double h) { return 1 + h; }, 1e-5), [](double h) { return 3 * h; });
  double last = 1;
  for (const double error : {0.3, 0.1, 0.05, 0.02, 0.01}) {
    const double size = choose_by_default(solve, error).last.size;
    EXPECT_LE(size, last) << error;
    last = size;
  }
  last = 1;
  for (const double within : {0.3, 1.0, 3.0, 10.0, 30.0}) {
    const ChosenRun chosen = choose_by_default(solve, 0.01, within);
    EXPECT_LE(chosen.last.size, last) << within;
    last = chosen.last.size;
    for (const TriedRun& run : chosen.report.runs) EXPECT_LE(run.seconds, within);
  }
}

// What counts is the work, not how long others kept the machine busy.
TEST(UsualSize, IsTheSameOnABusyMachine) {
  const auto on_machine = [](double slower) {
    const SolveAt solve =
        with_bars(made_up([](double h) { return 1 + h; }, 1e-4), [](double h) { return 9 * h; });
    return choose_by_default([=](std::optional<double> size, const GoesOn& goes_on) {
             SolvedRun run = solve(size, goes_on);
             run.processor_seconds = run.simulated.seconds;
             run.simulated.seconds *= slower;
             return run;
           })
        .last.size;
  };
  EXPECT_EQ(on_machine(1), on_machine(5));
}

TEST(UsualSize, FourCellsThroughWallsAndNoWordOfLatticesThatMissThem) {
  const SolveAt solve = with_bars(made_up([](double h) { return h > 0.05 ? 30.0 : 1 + 0.1 * h; }),
                                  [](double h) { return h > 0.05 ? 2.0 : 0.03; });
  const ChosenRun chosen = choose_by_default([&](std::optional<double> size, const GoesOn& goes_on) {
    SolvedRun run = solve(size, goes_on);
    run.wall = 0.06;
    return run;
  });
  EXPECT_LE(chosen.last.size, 0.06 / 4);
  EXPECT_EQ(chosen.report.runs.size(), 2u);
  EXPECT_NEAR(*chosen.report.runs.back().error, 0.03, 1e-12);  // beside 30 it would be 100 and more
}

TEST(UsualSize, BarsAreAsWideAsTheRunsAreApart) {
  int count = 0;
  const SolveAt solve =
      with_bars(made_up([&](double) { return ++count % 2 ? 1.0 : 1.3; }), [](double h) { return h; });
  const ChosenRun chosen = choose_by_default(solve, 0.05);
  const simulate::Bar& bar = chosen.last.simulated.error_bars.bars.front().bar;
  ASSERT_GT(chosen.report.runs.size(), 1u);
  EXPECT_NEAR(bar.half_width, *chosen.report.runs.back().error * chosen.last.mapped[0].z(), 1e-12);
  EXPECT_GT(bar.half_width, chosen.last.size);
}

TEST(UsualSize, WhatIsWrongIsSaidAtOnce) {
  int made = 0;
  const SolveAt refused = [&](std::optional<double> size, const GoesOn& goes_on) -> SolvedRun {
    ++made;
    if (size) throw InputError("no face \"top\"");
    return made_up([](double) { return 1.0; })(size, goes_on);
  };
  EXPECT_THROW(choose_by_default(refused), InputError);
  EXPECT_EQ(made, 2);  // the spacing, and one run
}

// Lattices of spacings below `ends` take for ever.
SolveAt endless_below(double ends) {
  return [=, solve = made_up([](double h) { return 1 + h; })](std::optional<double> size,
                                                              const GoesOn& goes_on) {
    while (size && *size < ends) check_stop();
    return solve(size, goes_on);
  };
}

TEST(Accuracy, ARunThatDoesNotEndIsMadeWithFewerCells) {
  const AccuracyReport report = choose_by_default(endless_below(0.1), 0.05, 0.1).report;
  EXPECT_EQ(report.runs.front().failure, "took too long");
  EXPECT_EQ(report.runs.front().size, 0.08);
  EXPECT_GT(report.runs.back().size, 0.16);
  EXPECT_GT(report.runs.back().cells, 0U);
}

TEST(Accuracy, RunsThatNeverEndStopTheCommand) {
  try {
    (void)choose_by_default(endless_below(1e9), 0.05, 0.1);
    FAIL() << "should have stopped";
  } catch (const TimeoutError& error) {
    EXPECT_NE(std::string(error.what()).find("no run ended in"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flexel::commands
