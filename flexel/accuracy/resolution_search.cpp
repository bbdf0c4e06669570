// Sizes are preferred numbers: slightly different predictions choose the same size, and `--size` with the
// printed value repeats the run. accuracy_report.cpp writes the report.
#include "flexel/accuracy/resolution_search.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "base/error.h"
#include "base/human.h"
#include "base/parallel.h"
#include "base/resources.h"
#include "base/stop.h"
#include "base/units.h"
#include "flexel/accuracy/run_error.h"
#include "flexel/study/predict.h"
#include "simulate/result/overload.h"
#include "voxelize/memory.h"

namespace flexel::commands {
namespace {

constexpr double kAim = 0.7;  // of the error asked for, when the next size is chosen
// Between the spacings of two runs: closer ones differ by how their cells meet the surface; the usual step
// where no error is known yet.
constexpr double kLeastStep = 1.4, kUsualStep = 2, kMostStep = 4;
constexpr double kCellsThroughWalls = 4;  // of which a lattice four times as coarse has one left
constexpr double kBelow = 1.06;           // half a step between preferred numbers
constexpr int kFinerRuns = 4, kFailures = 3;
constexpr double kUsualLimit = 180;   // s, without --within
constexpr double kMemoryShare = 0.8;  // of what is free
constexpr double kTimeMargin = 0.85;  // of the time left: predictions are good to about that
constexpr double kParallel = 0.85;    // share of the work that all threads do
constexpr double kPatience = 600;     // s: longer runs are not advised
constexpr double kLeastPatience = 0.05, kFirstPatience = 2;  // s; without the first run there is no answer

double nearest_size(double size) {
  return preferred_number(size, 20, Rounded::nearest);
}

// What the machine takes for so much work if nobody else uses it: no more than it did take.
double undisturbed(double wall, double processor) {
  if (!(processor > 0)) return wall;
  const double threads = static_cast<double>(thread_count());
  return std::min(wall, processor * (1 - kParallel + kParallel / threads));
}

// What the process has needed at most so far [bytes].
double peak_memory() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

constexpr double kFewer = 10;  // times fewer cells, where a first run takes too long
constexpr double kFirstShareOfTime = 0.8, kSecondShareOfTime = 0.6;  // with --within; by default
constexpr double kBusiest = 3;  // a machine so busy gets so many times as long

constexpr int kGivenUp = 3;  // lattices that turn out too large, until the search ends

class Search {
 public:
  Search(const AccuracyGoal& goal, const SolveAt& solve, AccuracyReport& report, Progress& progress)
      : goal_(goal),
        solve_(solve),
        report_(report),
        progress_(progress),
        quantities_(goal.driven),
        processor_before_(processor_seconds()) {}

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

  // The usual count of cells; a tenth of them where those take too long, finer ones where walls are lost at
  // that. For --within half the spacing too.
  void first_runs() {
    std::optional<StopAfter> all;
    if (goal_.within && !goal_.by_default)
      all.emplace(std::max(patience_left(), kFirstPatience), "--within", LimitOf::command);
    double size = 0;
    for (int failures = 0; runs_.empty();) {
      const StopAfter limit(first_patience(), "--within");
      try {
        if (size == 0) size = nearest_size(solve_(std::nullopt, {}).size);
        keep(solve_(size, [](std::size_t) { return true; }));
      } catch (const TimeoutError&) {
        if (!limit.passed() && !(all && all->passed())) throw;
        go_coarser(size);
      } catch (const InputError& error) {
        if (coarser_)
          throw TimeoutError(
              fmt::format("a first run took too long, and one of fewer cells is refused: {}; {}",
                          error.what(), longer()));
        fail(size, error.what(), failures++);
      } catch (const simulate::OverloadError&) {
        throw;
      } catch (const DivergedError& error) {
        fail(size, error.what(), failures++);
      }
    }
    if (goal_.error) return;
    size = nearest_size(runs_.back().size / kUsualStep);
    if (affordable(size)) run(size);
  }

  // s, until the first run of the usual count is given up, and one of fewer cells.
  [[nodiscard]] double first_patience() const {
    if (goal_.by_default)
      return (coarser_ ? kSecondShareOfTime : 1) * busyness() * goal_.within.value_or(kUsualLimit);
    return std::max(coarser_ ? patience_left() : kFirstShareOfTime * patience_left(), kFirstPatience);
  }

  [[nodiscard]] std::string longer() const {
    return goal_.by_default ? "--within 5min gives it longer" : "a longer --within gives it more time";
  }
  [[nodiscard]] std::string more_time() const {
    return longer() + (goal_.by_default ? ", --count 1000 has no limit" : "");
  }

  // Said of time that others had.
  [[nodiscard]] std::string while_busy() const {
    constexpr double kBusy = 0.5;
    const double processor = processor_seconds() - processor_before_;
    if (processor > kBusy * seconds_since(goal_.began)) return "";
    return fmt::format(" (others use this machine: {} of processor time)", human_seconds(processor));
  }

  // After the run at `size` (0: its lattice was not made) took too long.
  void go_coarser(double& size) {
    const std::string gone = human_seconds(seconds_since(goal_.began)) + while_busy();
    if (size == 0)
      throw TimeoutError(fmt::format("the lattice of a first run was not made in {}: {}", gone, more_time()));
    if (coarser_)
      throw TimeoutError(fmt::format(
          "no run ended in {}, though one of few cells was tried: {}{}", gone,
          while_busy().empty() ? "check the unit of the part and the size of the load; " : "", more_time()));
    coarser_ = true;
    note_failure(size, "took too long");
    size = nearest_size(size * std::cbrt(kFewer));
  }

  void fail(double& size, const std::string& why, int failures) {
    if (!first_failure_) first_failure_ = std::current_exception();
    if (size == 0 || failures >= kFailures || goal_.by_default || coarser_)
      std::rethrow_exception(first_failure_);
    note_failure(size, why);
    size = nearest_size(size / 2);
  }

  void note_failure(double size, const std::string& why) {
    TriedRun failed;
    failed.size = size;
    failed.failure = why;
    report_.runs.push_back(failed);
    progress_.say(fmt::format("--size {}: {}", size_text(size), why));
  }

  enum class Outcome { done, given_up, failed };

  // Given up where the lattice has more cells than the time or the memory that is left allow, and where it
  // takes longer in spite of that.
  Outcome run(double size) {
    study::Prediction predicted;
    const StopAfter limit(std::max(patience_left(), kLeastPatience), "--within");
    try {
      SolvedRun solved = solve_(size, [&](std::size_t cells) {
        counted_ = {size, static_cast<double>(cells)};
        predicted = prediction(size);
        return affordable(predicted);
      });
      if (solved.given_up) {
        say_unaffordable(predicted);
        return Outcome::given_up;
      }
      report_.stopped.clear();
      keep(std::move(solved));
      report_.runs.back().predicted_seconds = predicted.seconds;
      report_.runs.back().predicted_memory = predicted.bytes;
      return Outcome::done;
    } catch (const DivergedError&) {
      report_.stopped = fmt::format("the run at {} diverged", size_text(size));
    } catch (const TimeoutError&) {
      if (!limit.passed()) throw;
      report_.stopped = fmt::format("the run at {} took longer than predicted", size_text(size));
    } catch (const InputError& error) {
      report_.stopped = fmt::format("the run at {} cannot be made: {}", size_text(size), error.what());
    }
    return Outcome::failed;
  }

  void keep(SolvedRun solved) {
    const StopWaits answered;  // no limit of an attempt takes away an answer that is there
    const double total = solved.voxelize_seconds + solved.simulated.seconds +
                         solved.simulated.error_bars.seconds + solved.map_seconds;
    const double free =
        goal_.by_default && total > 0 ? undisturbed(total, solved.processor_seconds) / total : 1;
    study::RunResult observed;
    observed.stages = {{"voxelize", free * solved.voxelize_seconds},
                       {"solve", free * solved.simulated.seconds},
                       {"error bars", free * solved.simulated.error_bars.seconds},
                       {"map", free * solved.map_seconds}};
    observed.program_memory[0] = peak_memory();
    predictor_.add(study::kOneProcess, {static_cast<double>(solved.voxels.body.cell_count()), 1}, observed);
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
      tried.order = judged_->order;
    }
    progress_.say(fmt::format(
        "--size {}: {} cells, {}{}", size_text(tried.size), human_count(tried.cells), human_seconds(total),
        tried.error ? fmt::format(", error about {} ({})", human_share(*tried.error), tried.of) : ""));
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
    const double wall = seconds_since(goal_.began);
    const double gone = goal_.by_default ? undisturbed(wall, processor_seconds() - processor_before_) : wall;
    return goal_.within.value_or(kUsualLimit) - gone;
  }
  // How many times as long as on a machine that nobody else uses all took so far.
  [[nodiscard]] double busyness() const { return slowed_by_others(goal_.began); }
  // Until a run that is being tried is given up. By default sizes are chosen for a machine that nobody else
  // uses; a busy one gets up to three times as long.
  [[nodiscard]] double patience_left() const {
    return (goal_.by_default ? kBusiest : 1) * goal_.within.value_or(kUsualLimit) -
           seconds_since(goal_.began);
  }
  // What the runs that are kept hold already is part of the prediction.
  [[nodiscard]] double memory_limit() const { return kMemoryShare * (available_memory() + peak_memory()); }
  [[nodiscard]] bool affordable(double size) const { return affordable(prediction(size)); }
  [[nodiscard]] bool affordable(const study::Prediction& predicted) const {
    return predicted.seconds <= kTimeMargin * seconds_left() && predicted.bytes <= memory_limit();
  }

  // The finest size between two that is affordable; nothing where the coarser one is not.
  [[nodiscard]] std::optional<double> finest(double fine, double coarse) const {
    if (affordable(nearest_size(fine))) return nearest_size(fine);
    if (!affordable(coarse)) return std::nullopt;
    for (int i = 0; i < 30; ++i) {
      const double middle = std::sqrt(fine * coarse);
      (affordable(middle) ? coarse : fine) = middle;
    }
    return preferred_number(coarse, 10, Rounded::up);
  }

  // The size of the next run; nothing where the search is over.
  std::optional<double> next_size() {
    const SolvedRun& last = runs_.back();
    if ((goal_.error && met()) || chosen_) return std::nullopt;
    const double coarsest = last.size / kLeastStep;
    const std::optional<double> size = finest(wanted_size(), coarsest);
    if (!size && goal_.error) say_unaffordable(prediction(coarsest));
    return size && *size > coarsest ? nearest_size(coarsest) : size;
  }

  // Without regard to time and memory.
  [[nodiscard]] double wanted_size() const {
    const SolvedRun& last = runs_.back();
    if (!goal_.error) return last.size / 100;  // as fine as the time allows
    double step = kUsualStep;
    if (judged_)  // of order 1 where the bars show none
      step = std::clamp(std::pow(judged_->error / (kAim * *goal_.error), 1 / judged_->order), kLeastStep,
                        kMostStep);
    const double wanted = last.size / step;
    // Not a little above it: three cells become one and a half on the coarser lattice of an error bar.
    return std::min(wanted, last.wall / kCellsThroughWalls / kBelow);
  }
  void say_unaffordable(const study::Prediction& predicted) {
    report_.stopped =
        predicted.bytes > memory_limit()
            ? fmt::format("the next run would need {} of memory", human_bytes(predicted.bytes))
            : fmt::format("the next run would take about {}, of {} that are left",
                          human_seconds(predicted.seconds), human_seconds(std::max(0.0, seconds_left())));
  }

  // What would make the result surer, as far as the machine can.
  [[nodiscard]] std::string advice() const {
    if (!judged_) return "";
    const double goal = goal_.error && !met() ? *goal_.error : finer_goal(judged_->error);
    const double step = std::pow(judged_->error / (kAim * goal), 1 / judged_->order);
    const study::Prediction predicted = prediction(runs_.back().size / std::max(step, kLeastStep));
    const bool asked = goal_.error && !goal_.by_default && !met();
    if (asked && !goal_.within && given_up_ == 0 && affordable(predicted))
      return "";  // time was not the reason
    const double seconds = predicted.seconds + (asked ? seconds_since(goal_.began) : 0.2 * predicted.seconds);
    if (predicted.bytes > memory_limit() || seconds > kPatience) return met() ? "" : goes_on();
    return fmt::format("--accuracy {}{} takes about {}", fmt::format("{:.6g}%", 100 * goal),
                       seconds > kTimeMargin * kUsualLimit ? " --within 10min" : "", human_seconds(seconds));
  }
  // Where the error that was aimed at is out of reach: the time of a run with half the spacing.
  [[nodiscard]] std::string goes_on() const {
    const study::Prediction predicted = prediction(runs_.back().size / kUsualStep);
    const double seconds = (seconds_since(goal_.began) + predicted.seconds) / kTimeMargin;
    if (predicted.bytes > memory_limit()) return "";
    for (const int minutes : {1, 2, 3, 5, 10})
      if (const double longer = 60.0 * minutes; longer >= seconds && longer > goal_.within.value_or(0))
        return fmt::format("--within {}min makes a finer run", minutes);
    return "";
  }
  static double finer_goal(double error) {
    for (const double each : {0.1, 0.05, 0.02, 0.01, 0.005, 0.002})
      if (each < 0.7 * error) return each;
    return 0.001;
  }

  SolvedRun finish() {
    report_.advice = advice();
    widen_bars(runs_, quantities_);
    return std::move(runs_.back());
  }

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
  } counted_;             // of the lattice that was made last
  int given_up_ = 0;      // lattices that were not solved
  bool coarser_ = false;  // the first run took too long: one of fewer cells
  bool chosen_ = false;   // the one run that --within asks for was made
  double processor_before_;
  std::exception_ptr first_failure_;  // finer lattices did not help
};

}  // namespace

SolvedRun choose_resolution(const AccuracyGoal& goal, const SolveAt& solve, AccuracyReport& report,
                            Progress& progress) {
  report.goal = goal;
  return Search(goal, solve, report, progress)();
}

double seconds_since(std::chrono::steady_clock::time_point began) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

namespace {

double processor_seconds_of(int whose) {
  rusage usage = {};
  getrusage(whose, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

double processor_seconds() {
  return processor_seconds_of(RUSAGE_SELF);
}

double slowed_by_others(std::chrono::steady_clock::time_point began) {
  const double wall = seconds_since(began);
  const double alone = undisturbed(wall, processor_seconds() + processor_seconds_of(RUSAGE_CHILDREN));
  return alone > 0 ? std::clamp(wall / alone, 1.0, kBusiest) : 1;
}

double preferred_number(double value, int to_a_decade, Rounded rounded) {
  // ISO 3: the rounded ones are no exact powers
  constexpr double kTwenty[] = {1,    1.12, 1.25, 1.4, 1.6, 1.8, 2,   2.24, 2.5, 2.8,
                                3.15, 3.55, 4,    4.5, 5,   5.6, 6.3, 7.1,  8,   9};
  const int every = 20 / to_a_decade;
  const int near = static_cast<int>(std::floor(to_a_decade * std::log10(value)));
  const auto number = [&](int n) {
    const int decade = n >= 0 ? n / to_a_decade : -((to_a_decade - 1 - n) / to_a_decade);
    const double digits = kTwenty[every * (n - decade * to_a_decade)];
    // Divided where the power is below one: 8 / 100 is the double that "0.08" is
    return decade < 0 ? digits / std::pow(10, -decade) : digits * std::pow(10, decade);
  };
  double best = 0;
  for (int n = near - 1; n <= near + 2; ++n) {
    const double each = number(n);
    if (rounded == Rounded::up && each >= value * (1 - 1e-9)) return each;
    if (best == 0 || std::abs(std::log(each / value)) < std::abs(std::log(best / value))) best = each;
  }
  return best;
}

double mapping_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double difference = 0, largest = 0;
  for (std::size_t v = 0; v < a.size() && v < b.size(); ++v) {
    difference = std::max(difference, (a[v] - b[v]).norm());
    largest = std::max(largest, a[v].norm());
  }
  return largest > 0 ? difference / largest : 0;
}

}  // namespace flexel::commands
