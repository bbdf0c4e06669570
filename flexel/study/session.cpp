// The loop: predict the open configurations, run the cheapest that fits the budget, write its row; then
// repeat those whose time is not known to 5 %; then conclude.
#include "flexel/study/session.h"
#include "base/files/json.h"
#include "flexel/study/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/program/own_program.h"
#include "base/resources.h"
#include "base/units.h"
#include "flexel/study/runs/calculix.h"
#include "voxelize/memory.h"

namespace flexel::study {
namespace {

namespace fs = std::filesystem;

constexpr double kLookCells = 2000, kFewestCells = 200;
constexpr int kRungs = 12;
constexpr double kLadderShare = 0.7;  // of the budget, until when another size begins
constexpr double kFirstShare = 0.83;  // the same of the first run of any other trial
// Of the budget, for comparing the surfaces, for pictures and the page; at least so many seconds.
constexpr double kFinishShare = 0.12, kFinishLeast = 3;
constexpr double kMemoryShare = 0.8;  // of what is free
constexpr double kSideShare = 0.1;    // of the budget, the most that one run beside the ladder may take
constexpr double kFewerCells = 1.4;   // than a size is thought to give, by the size before it
constexpr double kKnown = 0.05;       // how well a median should be known
constexpr int kMostRepeats = 5;
constexpr double kLongest = 1e9;  // s

constexpr std::array kResults{"study.csv", "study.json", kViewer, "study.html", kOwnScene};

// The results of a study; not a scene that is its input, though an earlier study wrote it.
std::vector<const char*> results_of(const Assignment& wanted) {
  std::vector<const char*> names(kResults.begin(), kResults.end());
  std::error_code none;
  if (!wanted.writes_scene && fs::equivalent(wanted.study_case.scene, wanted.output / kOwnScene, none))
    names.pop_back();
  return names;
}

// What an earlier study that was killed left behind. The page is written last: without it, what that study had put
// aside is back.
void remove_stale(const fs::path& output) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(output, ignored)) {
    if (entry.path().filename().string().rfind(".flexel-", 0) != 0) continue;
    if (fs::exists(entry.path() / "study.html", ignored) && !fs::exists(output / "study.html", ignored))
      for (const char* name : kResults) fs::rename(entry.path() / name, output / name, ignored);
    fs::remove_all(entry.path(), ignored);
  }
}

// The results of an earlier study, out of the way in `folder` while this one runs; unless this one leaves its
// own (keep_new), what it wrote goes and they are back.
class EarlierResults {
 public:
  EarlierResults(const Assignment& wanted, const fs::path& folder)
      : output_(wanted.output), aside_(folder), names_(results_of(wanted)) {
    std::error_code ignored;
    for (const char* name : names_) fs::rename(output_ / name, aside_ / name, ignored);
  }
  ~EarlierResults() {
    if (!back_) return;
    std::error_code ignored;
    for (const char* name : names_) {
      fs::remove(output_ / name, ignored);
      fs::rename(aside_ / name, output_ / name, ignored);
    }
  }
  EarlierResults(const EarlierResults&) = delete;
  EarlierResults& operator=(const EarlierResults&) = delete;
  void keep_new() { back_ = false; }

 private:
  fs::path output_, aside_;
  std::vector<const char*> names_;
  bool back_ = true;
};

}  // namespace

Session::Session(const Assignment& wanted, Progress& progress) : wanted_(wanted), progress_(progress) {
  remove_stale(wanted.output);
  folder_.emplace(wanted.output);
  study_.parts = wanted.part_names;
  study_.scene = fs::path(wanted.study_case.scene).filename().string();
  study_.budget = wanted.budget;
  study_.facts = scene_facts(wanted.study_case.scene_text, wanted.study_case.scene);
  study_.machine = this_machine();
}

double Session::spent() const {
  return std::chrono::duration<double>(Clock::now() - begin_).count();
}

Deadline Session::deadline() const {
  return in(left());
}

Deadline Session::in(double seconds) const {
  // A clock counts nanoseconds: what it cannot hold is never.
  if (seconds > kLongest) return kNever;
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

double Session::left() const {
  return wanted_.budget - std::max(kFinishShare * wanted_.budget, kFinishLeast) - spent();
}

// A coarse lattice says how thick the walls are and how many cells a size gives.
Sweep Session::look() {
  progress_.stage("look");
  std::vector<std::string> arguments = {own_program("flexel-voxelize")};
  const std::string summary = (folder_->path() / "look.json").string();
  arguments.insert(arguments.end(), wanted_.study_case.parts.begin(), wanted_.study_case.parts.end());
  arguments.insert(arguments.end(), wanted_.study_case.voxelize_options.begin(),
                   wanted_.study_case.voxelize_options.end());
  arguments.insert(arguments.end(), {"--quiet", "--count", fmt::format("{:.0f}", kLookCells), "--summary",
                                     summary, "-o", (folder_->path() / "look.vtu").string()});
  ChildOptions options;
  options.log = folder_->path() / "look.log";
  options.deadline = in(left_to_look());
  const ChildRun run = run_child(arguments, options);
  if (run.out_of_time)
    throw InputError(
        fmt::format("a first look at the part takes more than the budget of {}: give more with "
                    "--budget",
                    human_seconds(wanted_.budget)));
  if (run.exit_code != 0) {
    const std::string error = error_in_log(options.log);
    throw InputError(!error.empty() ? error
                                    : fmt::format("flexel-voxelize ended with exit code {}", run.exit_code));
  }
  std::ifstream in(summary);
  const auto found = load_json(in);
  double cells = 0, spacing = 0, volume = 0, together = 0, thinnest = 1e300;
  for (const auto& part : found["parts"]) {
    cells += part["cells"].get<double>();
    volume = std::max(volume, part["surface_volume"].get<double>());
    together += part["surface_volume"].get<double>();
    const auto& h = part["spacing"];
    spacing = std::max(spacing, std::cbrt(h[0].get<double>() * h[1].get<double>() * h[2].get<double>()));
    if (!part["thinnest_wall"].is_null())
      thinnest = std::min(thinnest, part["thinnest_wall"]["thickness"].get<double>());
  }
  const double wall = thinnest < 1e300 ? thinnest : std::cbrt(volume);
  Configuration first;
  if (study_.facts.model == "paper") first.model = "paper";
  Sweep sweep(study_.facts, first, ladder_of_sizes(wall, spacing, cells, kFewestCells, kRungs),
              wanted_.budget, study_.machine.cores);
  if (wanted_.against_calculix) look_at_other(sweep, together);
  return sweep;
}

void Session::run() {
  std::optional<EarlierResults> earlier;
  try {
    earlier.emplace(wanted_, folder_->path());
    if (wanted_.writes_scene) write_text(wanted_.study_case.scene_text, wanted_.study_case.scene);
    Sweep sweep = look();
    run_all(sweep);
    repeat_all(sweep);
  } catch (const Interrupted&) {
    if (study_.rows.empty()) throw;  // there is nothing to keep
    note_interrupt();
  }
  finish();
  if (earlier) earlier->keep_new();
}

void Session::note_interrupt() {
  interrupted_ = true;
  study_.notes.emplace_back(
      "This study was interrupted: it holds the runs that had ended, and no comparison of surfaces.");
}

void Session::run_all(Sweep& sweep) {
  progress_.stage("runs");
  while (run_cheapest(sweep)) {
  }
  if (std::none_of(study_.rows.begin(), study_.rows.end(), [](const Row& row) { return row.found.ok(); })) {
    std::string why = study_.rows.empty()
                          ? fmt::format(
                                "the first run is predicted to take more than the "
                                "budget of {}: give more with --budget",
                                human_seconds(wanted_.budget))
                          : "no run went well; the first: " + study_.rows.front().found.failure;
    if (left() <= 0 && !study_.rows.empty()) why += "; give more time with --budget";
    throw InputError(why);
  }
}

std::ptrdiff_t Session::sizes_done(const std::string& sweep) const {
  return std::count_if(study_.rows.begin(), study_.rows.end(), [&](const Row& row) {
    return row.trial.sweep == sweep && row.repeat == 1 && row.found.ok();
  });
}

// False when nothing is open any more.
bool Session::run_cheapest(Sweep& sweep) {
  const std::vector<Trial> open = sweep.open();
  if (open.empty()) return false;
  std::vector<Prediction> predicted;
  for (const Trial& trial : open) predicted.push_back(sweep.predict(trial));
  // The first three sizes go before all else, then the first three of CalculiX: without them there is nothing
  // to compare with.
  std::size_t best = 0;
  for (std::size_t i = 1; i < open.size(); ++i)
    if (predicted[i].seconds < predicted[best].seconds) best = i;
  for (const char* ladder : {"calculix", "resolution"})
    if (sizes_done(ladder) < 3)
      for (std::size_t i = 0; i < open.size(); ++i)
        if (open[i].sweep == ladder) best = i;
  const Trial& trial = open[best];
  const Prediction& prediction = predicted[best];
  // The lattice may have fewer cells than the size's cube suggests: then the run is considered again.
  const std::string why = why_not(trial, prediction.scaled(1 / kFewerCells));
  if (why.empty())
    run_one(sweep, trial, prediction);
  else
    leave_out(sweep, trial, prediction, why);
  return true;
}

// Why a configuration is not run; "" where it may run.
std::string Session::why_not(const Trial& trial, const Prediction& prediction) const {
  const bool size = trial.sweep == "resolution" || trial.sweep == "calculix";
  // Something is better than nothing: the first of all may take what there is.
  const double time_left =
      study_.rows.empty() ? left() : (size ? kLadderShare : kFirstShare) * wanted_.budget - spent();
  if (prediction.seconds > time_left)
    return fmt::format("time: {} were left for {}", human_seconds(std::max(0.0, time_left)),
                       size ? "another size" : "first runs");
  if (!size && prediction.seconds > kSideShare * wanted_.budget)
    return "time: beside the sizes no run may take more than a tenth of the budget";
  if (prediction.bytes > kMemoryShare * available_memory())
    return fmt::format("memory: {} are free", human_bytes(available_memory()));
  return "";
}

void Session::leave_out(Sweep& sweep, const Trial& trial, const Prediction& prediction,
                        const std::string& why) {
  study_.left_out.push_back({trial, prediction, why});
  sweep.leave_out(trial);
}

void Session::repeat_all(Sweep& sweep) {
  for (;;) {
    std::map<std::string, std::pair<const Row*, std::vector<double>>> seen;
    std::set<std::string> failed;  // once: they would again
    for (const Row& row : study_.rows)
      if (!row.found.ok()) {
        failed.insert(row.trial.label);
      } else if ((row.trial.sweep == "resolution" || row.trial.sweep == "calculix") &&
                 row.found.thin_matter <= kThinMatter) {
        auto& entry = seen[row.trial.label];
        if (entry.first == nullptr) entry.first = &row;
        entry.second.push_back(row.found.wall);
      }
    const Row* next = nullptr;
    double shortest = left() / 1.2;  // a margin: a repeat that is stopped is wasted
    for (const auto& [label, entry] : seen) {
      const Median wall = median(entry.second);
      if (failed.count(label) > 0 || wall.relative_error <= kKnown || entry.second.size() >= kMostRepeats ||
          wall.value >= shortest)
        continue;
      next = entry.first;
      shortest = wall.value;
    }
    if (next == nullptr) return;
    const Trial trial = next->trial;
    run_one(sweep, trial, sweep.predict(trial));
  }
}

std::string Session::kept(const char* what, const Trial& trial, const char* ending) const {
  return (folder_->path() / fmt::format("{}-{}{}", what, numbers_.at(trial.label), ending)).string();
}

void Session::run_one(Sweep& sweep, const Trial& trial, Prediction predicted) {
  const bool first = numbers_.try_emplace(trial.label, numbers_.size()).second;
  Row row;
  row.trial = trial;
  for (const Row& each : study_.rows) row.repeat += each.trial.label == trial.label;
  RunOptions options;
  std::string why;
  options.goes_on = [&](std::size_t size) {
    predicted = sweep.predict(trial, size);
    if (first) why = why_not(trial, predicted);
    return why.empty();
  };
  progress_.update(spent() / wanted_.budget, trial.label);
  row.found = run_trial(trial, first, options);
  if (row.found.given_up) {
    numbers_.erase(trial.label);
    return leave_out(sweep, trial, predicted, why);
  }
  row.predicted = predicted;
  sweep.done(trial, row.found);
  study_.rows.push_back(row);
  append(row);
  if (first) keep_finest_body(trial);
  if (row.found.ok())
    progress_.say(fmt::format("{}{}: {} {}, {} (predicted {}), {} (predicted {})", trial.label,
                              first ? "" : fmt::format(", run {}", row.repeat), human_count(row.found.size()),
                              trial.sweep == "calculix" ? "tetrahedra" : "cells",
                              human_seconds(row.found.wall), human_seconds(predicted.seconds),
                              human_bytes(row.found.memory), human_bytes(predicted.bytes)));
  else
    progress_.say(fmt::format("{}: {}", trial.label, row.found.failure));
}

RunResult Session::run_trial(const Trial& trial, bool first, const RunOptions& asked) const {
  RunOptions options = asked;
  options.folder = folder_->path();
  options.deadline = deadline();
  if (trial.sweep == "calculix")
    return run_calculix(wanted_.study_case, trial.configuration.size, large_deflection_, study_.machine.cores,
                        options);
  if (first) {
    options.surface = kept("surface", trial, ".ply");
    options.history = kept("history", trial, ".csv");
    if (trial.sweep == "resolution") options.body = kept("body", trial, ".vtu");
  }
  return run_configuration(wanted_.study_case, trial.configuration, options);
}

// Of the last run: a body takes more of the disk than a surface.
void Session::keep_finest_body(const Trial& trial) const {
  const fs::path body = kept("body", trial, ".vtu");
  if (!fs::exists(body)) return;
  if (finest_row() == &study_.rows.back())
    fs::rename(body, folder_->path() / kFinestBody);
  else
    fs::remove(body);
}

// study.csv grows as runs end, so that whatever happens the rows are there.
void Session::append(const Row& row) {
  waiting_.push_back(row);
  if (!columns_ && (!row.found.ok() || row.trial.sweep == "calculix")) return;
  const std::string path = (wanted_.output / "study.csv").string();
  std::string text;
  if (!columns_) {
    columns_ = row.found.quantities;
    text = csv_header(*columns_);
  }
  std::size_t number = study_.rows.size() - waiting_.size();
  for (const Row& each : waiting_) text += csv_line(++number, each, *columns_);
  waiting_.clear();
  std::ofstream out(path, std::ios::app);
  out << text << std::flush;
  if (!out) throw InputError(path, "cannot be written: is the disk full?");
}

const Row* Session::finest_row() const {
  const Row* finest = nullptr;
  for (const Row& row : study_.rows)
    if (row.found.ok() && row.trial.sweep == "resolution" &&
        (finest == nullptr || row.found.spacing < finest->found.spacing))
      finest = &row;
  return finest;
}

}  // namespace flexel::study
