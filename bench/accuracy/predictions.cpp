// Whether a study's predictions of time and memory hold (docs/measurements/performance.md): the same part and scene at sizes
// with 2.5 times the cells each, each one predicted from those before it, once its lattice is made and its
// cells are counted, and then run.
//
//     build/release/bin/predictions PART SCENE.toml COARSEST-SIZE-MM [MOST-CELLS]
//
// Seconds are the processor's, which other jobs change little: the wall time of each context is scaled by the
// run's processor seconds over its wall time. Ends with 1 where a run of 10,000 cells or more was predicted
// over 1.5 times too high or too low.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/files/files.h"
#include "flexel/study/predict.h"
#include "flexel/study/runs/runner.h"

namespace {

using namespace flexel;

constexpr double kGrowth = 2.5, kJudgedFrom = 10'000, kFactor = 1.5;

double off(double predicted, double measured) {
  return std::max(predicted / measured, measured / predicted);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "predictions PART SCENE.toml COARSEST-SIZE-MM [MOST-CELLS]\n");
    return 2;
  }
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const Bytes scene = read_all(argv[2]);
  const study::Case wanted{
      {argv[1]}, {}, argv[2], {reinterpret_cast<const char*>(scene.data()), scene.size()}};
  double size = 1e-3 * std::atof(argv[3]), cells = 0;
  const double most = argc > 4 ? std::atof(argv[4]) : 1'100'000;
  study::Predictor predictor;
  bool all = true;
  fmt::print("| cells | wall s | cpu s | predicted | ratio | memory MB | predicted | ratio |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (; cells * kGrowth < most; size /= std::cbrt(kGrowth)) {
    study::Configuration configuration;
    configuration.size = size;
    study::Prediction told;
    study::RunOptions options;
    options.folder = folder;
    options.goes_on = [&](std::size_t counted) {
      told = predictor.predict("", {static_cast<double>(counted)});
      return true;
    };
    study::RunResult run = study::run_configuration(wanted, configuration, options);
    if (!run.ok()) {
      fmt::print(stderr, "{}\n", run.failure);
      return 1;
    }
    const double found = static_cast<double>(run.size());
    for (study::Stage& stage : run.stages) stage.wall *= run.cpu / run.wall;
    predictor.add("", {found}, run);
    if (cells > 0) {
      fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} | {:.0f} | {:.2f} |\n", run.size(),
                 run.wall, run.cpu, told.seconds, told.seconds / run.cpu, run.memory / 1e6, told.bytes / 1e6,
                 told.bytes / run.memory);
      std::fflush(stdout);
      if (found >= kJudgedFrom)
        all = all && off(told.seconds, run.cpu) <= kFactor && off(told.bytes, run.memory) <= kFactor;
    }
    cells = found;
  }
  return all ? 0 : 1;
}
