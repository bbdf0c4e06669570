// Which runs a study makes: sizes first, and the other choices where somebody asks for them.
#include "flexel/study/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace flexel::study {
namespace {

study::RunResult run_of(std::size_t cells, double wall, double thin_matter = 0) {
  study::RunResult run;
  run.cells = run.elements = cells;
  run.wall = run.cpu = wall;
  run.thin_matter = thin_matter;
  run.spacing = 1e-3;
  return run;
}

std::set<std::string> sweeps_of(const std::vector<study::Trial>& trials) {
  std::set<std::string> names;
  for (const study::Trial& each : trials) names.insert(each.sweep);
  return names;
}

constexpr double kBudget = 120;

study::Sweep sweep() {
  return {study::SceneFacts{}, study::Configuration{}, {8e-3, 4e-3, 2e-3, 1e-3}, kBudget, 4};
}

// Runs the sizes that are given, and leaves the next one out.
study::Sweep climbed(const std::vector<study::RunResult>& runs) {
  study::Sweep result = sweep();
  for (const study::RunResult& run : runs) {
    const std::vector<study::Trial> open = result.open();
    EXPECT_EQ(open.size(), 1u);
    EXPECT_EQ(open[0].sweep, "resolution");
    result.done(open[0], run);
  }
  if (const std::vector<study::Trial> open = result.open(); !open.empty() && open[0].sweep == "resolution")
    result.leave_out(open[0]);
  return result;
}

TEST(StudySweep, NothingButSizesRunsBeforeTheFinest) {
  study::Sweep study = sweep();
  for (const std::size_t cells : {100, 800, 6400, 51200}) {
    const std::vector<study::Trial> open = study.open();
    EXPECT_EQ(sweeps_of(open), (std::set<std::string>{"resolution"})) << cells;
    study.done(open.at(0), run_of(cells, 1e-4 * static_cast<double>(cells)));
  }
  EXPECT_EQ(sweeps_of(study.open()).count("resolution"), 0u);
}

TEST(StudySweep, ChoicesAreMadeAtOneSizeOfUse) {
  study::Sweep study = climbed({run_of(458, 0.1), run_of(2278, 0.4), run_of(18000, 3)});
  std::set<std::string> run;
  while (!study.open().empty()) {
    // What changes the answer goes before what changes its last digits.
    const std::vector<study::Trial> open = study.open();
    for (const study::Trial& each : open) {
      EXPECT_DOUBLE_EQ(each.configuration.size, 4e-3) << each.label;
      EXPECT_NE(each.sweep == "model" || each.sweep == "effect",
                open[0].sweep != "model" && open[0].sweep != "effect");
    }
    run.insert(open[0].sweep);
    study.done(open[0], run_of(2278, 0.4));
  }
  EXPECT_EQ(run, (std::set<std::string>{"model", "mapping", "threads", "tolerance", "effect"}));
}

TEST(StudySweep, NoChoiceIsMadeWhereItAnswersNobody) {
  EXPECT_TRUE(climbed({run_of(110, 0.05), run_of(1084, 0.1)}).open().empty());             // too coarse
  EXPECT_TRUE(climbed({run_of(3000, 0.3, 0.5), run_of(9000, 1, 0.3)}).open().empty());     // than the walls
  EXPECT_TRUE(climbed({run_of(300, 0.1), run_of(30000, 0.06 * kBudget)}).open().empty());  // too dear
  EXPECT_FALSE(climbed({run_of(300, 0.1), run_of(30000, 0.04 * kBudget)}).open().empty());
}

}  // namespace
}  // namespace flexel::study
