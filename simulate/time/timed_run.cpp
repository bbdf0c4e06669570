// The loop over steps. Every kCheck steps the bound on the step is taken anew and the state kept as the last
// good one; frames, books and what happens when a run fails are seen to here.
#include "simulate/time/timed_run.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "formats/body_file.h"
#include "formats/error.h"
#include "formats/files.h"
#include "formats/program.h"
#include "simulate/time/act.h"
#include "simulate/time/series.h"

namespace flexel {
namespace {

constexpr int kCheck = 100;          // steps between checks
constexpr std::size_t kRows = 1000;  // of the history, unless the scene says otherwise
constexpr std::size_t kFrames = 50;  // likewise

class TimedRun {
 public:
  TimedRun(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress);
  SimulateResult operator()();

 private:
  void explain();
  void play();
  void check();
  void step();
  void write_frame();
  void write_history();
  [[nodiscard]] std::string save_failed();
  SimulateResult report();

  Body& body_;
  const Scene& scene_;
  const SimulateOptions& options_;
  Progress& progress_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  double duration_;
  Clock clock_;
  std::optional<Act> act_;
  std::unique_ptr<History> history_;  // of the act; null: none asked for
  std::optional<Series> series_;
  State good_;
  double next_row_ = 0, next_frame_ = 0;
};

TimedRun::TimedRun(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress)
    : body_(body), scene_(scene), options_(options), progress_(progress), duration_(*scene.run.time) {
  clock_.until = duration_;
  act_.emplace(body, scene, options, progress, beginning(body), true);
  if (!options.history.empty()) history_ = act_->make_history({});
  if (!options.series.empty()) series_.emplace(options.series, options.compress);
}

void TimedRun::explain() {
  if (!options_.explain) return;
  progress_.say(fmt::format("plan: cells (the parts' models), {} steps of {:.4g} s, kernel {}",
                            static_cast<std::uint64_t>(std::llround(duration_ / clock_.step)), clock_.step,
                            act_->stepper().isa()));
  if (act_->solves())
    progress_.say(
        "plan: every step solves for the damping, which taken explicitly would cut it by more than 2");
  for (const Pass& pass : act_->passes()) progress_.say(fmt::format("plan: {} ({})", pass.name, pass.why));
}

void TimedRun::check() {
  throw_if_interrupted();
  const double time = *act_->state().time;
  if (options_.timeout &&
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count() > *options_.timeout) {
    good_ = act_->state();
    throw TimeoutError(fmt::format("stopped by --timeout after {} steps at {:.4g} s of {:.4g} s{}",
                                   clock_.steps, time, duration_, save_failed()));
  }
  act_->refuse_unsound();
  good_ = act_->state();
  act_->adapt_step(clock_);
  progress_.update(time / duration_, fmt::format("{:.4g} s, step {}", time, clock_.steps));
}

void TimedRun::step() {
  const bool row = history_ && *act_->state().time >= next_row_;
  if (row) next_row_ += scene_.run.history_every.value_or(duration_ / kRows);
  act_->step(clock_, history_.get(), row);
}

void TimedRun::write_frame() {
  if (!series_) return;
  act_->store(act_->state());
  series_->add(body_, *act_->state().time);
  next_frame_ = duration_ * static_cast<double>(series_->size()) / scene_.run.frames.value_or(kFrames);
}

void TimedRun::write_history() {
  OutputFile file(options_.history, false);
  file.write(history_->ledger().csv());
  file.commit();
}

std::string TimedRun::save_failed() {
  if (history_) write_history();
  if (options_.failed_output.empty() || good_.displacement.empty()) return "";
  act_->store(good_);
  write_body(body_, options_.failed_output);
  return fmt::format("; the state at {:.6g} s is in {}", *good_.time, options_.failed_output);
}

SimulateResult TimedRun::report() {
  SimulateResult result;
  act_->report(clock_, result);
  if (history_) {
    const Ledger& ledger = history_->ledger();
    const Energies& last = ledger.rows.back().energies;
    result.timed->books = {{"kinetic", last.kinetic},
                           {"elastic", last.elastic},
                           {"potential", last.potential},
                           {"work", last.work},
                           {"dissipated", last.dissipated},
                           {"worst_residual", ledger.worst_residual},
                           {"largest_term", ledger.largest_term}};
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  return result;
}

void TimedRun::play() {
  act_->choose_step(clock_);
  explain();
  write_frame();
  good_ = act_->state();
  while (*act_->state().time < clock_.until * (1 - 1e-12)) {
    if (clock_.steps % kCheck == 0) check();
    step();
    if (series_ && *act_->state().time >= next_frame_ * (1 - 1e-9)) write_frame();
  }
  act_->refuse_unsound();  // a step looks at the state that it begins with; nothing has looked at the last
                           // one
}

SimulateResult TimedRun::operator()() {
  try {
    play();
    if (history_) act_->close_books(clock_, *history_);
  } catch (const DivergedError& error) {
    throw DivergedError(fmt::format("step {} at {:.6g} s: {}{}", clock_.steps, *act_->state().time,
                                    error.what(), save_failed()));
  } catch (const Interrupted&) {
    good_ = act_->state();
    if (const std::string saved = save_failed(); !saved.empty())
      progress_.say(fmt::format("interrupted at step {}{}", clock_.steps, saved));
    throw;
  }
  if (history_) write_history();
  act_->store(act_->state());
  return report();
}

}  // namespace

SimulateResult run_in_time(Body& body, const Scene& scene, const SimulateOptions& options,
                           Progress& progress) {
  return TimedRun(body, scene, options, progress)();
}

}  // namespace flexel
