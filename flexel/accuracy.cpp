// Sizes are kept to three digits, so that `--size` with what is printed gives the same run.
#include "flexel/accuracy.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "flexel/judged_error.h"
#include "flexel/study/predict.h"
#include "formats/error.h"
#include "formats/units.h"
#include "voxelize/memory.h"

namespace flexel {
namespace {

constexpr double kAim = 0.7;                          // of the error asked for, when the next size is chosen
constexpr double kLeastStep = 1.25, kMostStep = 1.7;  // between the spacings of two runs
constexpr int kFinerRuns = 4, kFailures = 3;
constexpr double kUsualLimit = 180;   // s, without --within
constexpr double kMemoryShare = 0.8;  // of what is free
constexpr double kTimeMargin = 0.85;  // of the time left: predictions are good to about that

double round3(double x) {
  const double unit = std::pow(10, std::floor(std::log10(x)) - 2);
  return std::round(x / unit) * unit;
}

// In words that --size takes.
std::string size_text(double size) {
  return fmt::format("{:.6g}mm", 1e3 * size);
}

// What the process has needed at most so far [bytes].
double peak_memory() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

nlohmann::ordered_json json_of(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nullptr;
}

constexpr int kGivenUp = 3;  // lattices that turn out too large, until the search ends

class Search {
 public:
  Search(const AccuracyGoal& goal, const SolveAt& solve, AccuracyReport& report, Progress& progress)
      : goal_(goal), solve_(solve), report_(report), progress_(progress), quantities_(goal.driven) {}

  SolvedRun operator()() {
    first_runs();
    for (int finer = 0; finer < kFinerRuns;) {
      const std::optional<double> size = next_size();
      if (!size) return finish();
      const Outcome outcome = run(*size);
      if (outcome == Outcome::failed) break;
      if (outcome == Outcome::given_up) {
        if (++given_up_ > kGivenUp) break;
        continue;
      }
      chosen_ = !goal_.error;
      ++finer;
    }
    if (goal_.error && !met() && report_.stopped.empty())
      report_.stopped = fmt::format("{} runs did not close in on a value", report_.runs.size());
    return finish();
  }

 private:
  [[nodiscard]] bool met() const { return goal_.error && judged_ && judged_->error <= *goal_.error; }

  // About 2,000 cells, and half the spacing; finer where walls are lost at that.
  void first_runs() {
    double size = 0;
    for (int failures = 0; runs_.empty(); ++failures) try {
        if (size == 0) {
          const SolvedRun first = solve_(std::nullopt, {});
          size = round3(spacing_of(first));
        }
        keep(solve_(size, [](std::size_t) { return true; }));
      } catch (const InputError& error) {
        fail(size, error.what(), failures);
      } catch (const DivergedError& error) {
        fail(size, error.what(), failures);
      }
    size = round3(runs_.back().size / 2);
    if (affordable(size)) run(size);
  }

  void fail(double& size, const std::string& why, int failures) {
    if (size == 0 || failures >= kFailures) throw;
    TriedRun failed;
    failed.size = size;
    failed.failure = why;
    report_.runs.push_back(failed);
    size = round3(size / 2);
  }

  enum class Outcome { done, given_up, failed };

  // Given up where the lattice has more cells than the time or the memory that is left allow.
  Outcome run(double size) {
    study::Prediction told;
    try {
      SolvedRun solved = solve_(size, [&](std::size_t cells) {
        counted_ = {size, static_cast<double>(cells)};
        told = prediction(size);
        return affordable(told);
      });
      if (solved.given_up) {
        say_unaffordable(told);
        return Outcome::given_up;
      }
      report_.stopped.clear();
      keep(std::move(solved));
      report_.runs.back().predicted_seconds = told.seconds;
      report_.runs.back().predicted_memory = told.bytes;
      return Outcome::done;
    } catch (const DivergedError&) {
      report_.stopped = fmt::format("the run at {} diverged", size_text(size));
    } catch (const InputError& error) {
      report_.stopped = fmt::format("the run at {} cannot be made: {}", size_text(size), error.what());
    }
    return Outcome::failed;
  }

  void keep(SolvedRun solved) {
    study::RunResult observed;
    observed.stages = {{"voxelize", solved.voxelize_seconds},
                       {"solve", solved.simulated.seconds},
                       {"error bars", solved.simulated.error_bars.seconds},
                       {"map", solved.map_seconds}};
    observed.program_memory[0] = peak_memory();
    predictor_.add(study::kOneProcess, {static_cast<double>(solved.voxels.body.cell_count()), 1}, observed);
    const double total = solved.voxelize_seconds + solved.simulated.seconds +
                         solved.simulated.error_bars.seconds + solved.map_seconds;
    counted_ = {solved.size, static_cast<double>(solved.voxels.body.cell_count())};
    runs_.push_back(std::move(solved));
    if (runs_.size() > 3) runs_.erase(runs_.begin());
    judged_ = judge(runs_, quantities_);
    TriedRun tried;
    tried.size = runs_.back().size;
    tried.cells = runs_.back().voxels.body.cell_count();
    tried.seconds = total;
    tried.memory = observed.program_memory[0];
    for (const Quantity& each : quantities_.of(runs_.back(), runs_.back()))
      tried.found.emplace_back(each.name, each.value);
    if (judged_) {
      tried.error = judged_->error;
      tried.of = judged_->of;
    }
    progress_.say(fmt::format(
        "--size {}: {} cells, {:.2g} s{}", size_text(tried.size), human_count(tried.cells), total,
        tried.error ? fmt::format(", error about {:.2g} % ({})", 100 * *tried.error, tried.of) : ""));
    report_.runs.push_back(std::move(tried));
  }

  // From the lattice that was made last: a cube of half the spacing has eight times the cells, walls of a
  // cell or two may have any number.
  [[nodiscard]] double cells_at(double size) const {
    return counted_.cells * std::pow(counted_.size / size, 3);
  }
  // As the study does (study/predict.h), from the runs that were made.
  [[nodiscard]] study::Prediction prediction(double size) const {
    return predictor_.predict(study::kOneProcess, {cells_at(size), 1});
  }
  [[nodiscard]] double seconds_left() const {
    return goal_.within.value_or(kUsualLimit) - seconds_since(goal_.began);
  }
  // What the runs that are kept hold already is part of the prediction.
  [[nodiscard]] double memory_limit() const { return kMemoryShare * (available_memory() + peak_memory()); }
  [[nodiscard]] bool affordable(double size) const { return affordable(prediction(size)); }
  [[nodiscard]] bool affordable(const study::Prediction& told) const {
    return told.seconds <= kTimeMargin * seconds_left() && told.bytes <= memory_limit();
  }

  // The finest size between two that is affordable; nothing where the coarser one is not.
  [[nodiscard]] std::optional<double> finest(double fine, double coarse) const {
    if (affordable(round3(fine))) return round3(fine);
    if (!affordable(round3(coarse))) return std::nullopt;
    for (int i = 0; i < 30; ++i) {
      const double middle = std::sqrt(fine * coarse);
      (affordable(middle) ? coarse : fine) = middle;
    }
    return round3(1.005 * coarse);
  }

  // The size of the next run; nothing where the search is over.
  std::optional<double> next_size() {
    const double last = runs_.back().size;
    if ((goal_.error && met()) || chosen_) return std::nullopt;
    double wanted = last / kMostStep;
    if (goal_.error && judged_) {
      const double step = std::pow(judged_->error / (kAim * *goal_.error), 1 / judged_->order);
      wanted = last / std::clamp(step, kLeastStep, kMostStep);
    } else if (!goal_.error) {
      wanted = last / 100;  // as fine as the time allows
    }
    const std::optional<double> size = finest(wanted, last / kLeastStep);
    if (!size && goal_.error) say_unaffordable(prediction(last / kLeastStep));
    return size;
  }

  void say_unaffordable(const study::Prediction& told) {
    report_.stopped = told.bytes > memory_limit()
                          ? fmt::format("the next run would need {} of memory", human_bytes(told.bytes))
                          : fmt::format("the next run would take about {:.2g} s, of {:.2g} s that are left",
                                        told.seconds, std::max(0.0, seconds_left()));
  }

  SolvedRun finish() { return std::move(runs_.back()); }

  const AccuracyGoal& goal_;
  const SolveAt& solve_;
  AccuracyReport& report_;
  Progress& progress_;
  Quantities quantities_;
  study::Predictor predictor_;
  std::vector<SolvedRun> runs_;  // the last three that went well
  std::optional<Judged> judged_;
  struct Counted {
    double size = 0;  // m, asked for
    double cells = 0;
  } counted_;            // of the lattice that was made last
  int given_up_ = 0;     // lattices that were not solved
  bool chosen_ = false;  // the one run that --within asks for was made
};

}  // namespace

bool AccuracyReport::met() const {
  const std::optional<double> reached = runs.empty() ? std::nullopt : runs.back().error;
  return (!goal.error || (reached && *reached <= *goal.error)) && (!goal.within || seconds <= *goal.within);
}

std::string AccuracyReport::sentence() const {
  const TriedRun& last = runs.back();
  std::string asked = goal.error ? fmt::format("--accuracy {:.3g}%", 100 * *goal.error) : "";
  if (goal.within) asked += fmt::format("{}--within {:.3g}s", asked.empty() ? "" : ", ", *goal.within);
  std::string text =
      fmt::format("{}: chose --size {} ({} cells) and --method {}; {:.2g} s with {} run(s) before it", asked,
                  size_text(last.size), human_count(last.cells), method, seconds, runs.size() - 1);
  text += last.error ? fmt::format("; the error reached is about {:.2g} % ({})", 100 * *last.error, last.of)
                     : "; its error is not known: no coarser run to compare with";
  if (!met())
    text += goal.error && !(last.error && *last.error <= *goal.error)
                ? fmt::format(", NOT the {:.3g} % asked for{}", 100 * *goal.error,
                              stopped.empty() ? "" : ": " + stopped)
                : ", and it took longer than predicted";
  return text;
}

std::string AccuracyReport::json() const {
  nlohmann::ordered_json json;
  json["asked"] = json_of(goal.error);
  json["within"] = json_of(goal.within);
  json["size"] = runs.back().size;
  json["method"] = method;
  json["reached"] = json_of(runs.back().error);
  json["of"] = runs.back().of;
  json["met"] = met();
  json["seconds"] = seconds;
  json["stopped"] = stopped;
  json["runs"] = nlohmann::ordered_json::array();
  for (const TriedRun& each : runs)
    json["runs"].push_back({{"size", each.size},
                            {"cells", each.cells},
                            {"seconds", each.seconds},
                            {"memory", each.memory},
                            {"predicted_seconds", json_of(each.predicted_seconds)},
                            {"predicted_memory", json_of(each.predicted_memory)},
                            {"error", json_of(each.error)},
                            {"quantities", each.found},
                            {"failure", each.failure}});
  json["sentence"] = sentence();
  return json.dump();
}

SolvedRun choose_resolution(const AccuracyGoal& goal, const SolveAt& solve, AccuracyReport& report,
                            Progress& progress) {
  report.goal = goal;
  return Search(goal, solve, report, progress)();
}

double seconds_since(std::chrono::steady_clock::time_point began) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

double mapping_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double difference = 0, largest = 0;
  for (std::size_t v = 0; v < a.size() && v < b.size(); ++v) {
    difference = std::max(difference, (a[v] - b[v]).norm());
    largest = std::max(largest, a[v].norm());
  }
  return largest > 0 ? difference / largest : 0;
}

}  // namespace flexel
