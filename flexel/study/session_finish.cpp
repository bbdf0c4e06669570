// After the runs, in the remaining time: distances from the finest surface, pictures of the errors, and the
// page.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/program/own_program.h"
#include "base/units.h"
#include "flexel/study/conclude.h"
#include "flexel/study/page.h"
#include "flexel/study/plots.h"
#include "flexel/study/runs/history_csv.h"
#include "flexel/study/runs/surfaces.h"
#include "flexel/study/session.h"
#include "flexel/study/tables.h"

namespace flexel::study {
namespace {

namespace fs = std::filesystem;

// Of the budget, at least so many seconds, for the plots and the page alone.
constexpr double kPageShare = 0.04, kPageLeast = 1.5;

}  // namespace

double Session::left_to_look() const {
  return wanted_.budget - std::max(kPageShare * wanted_.budget, kPageLeast) - spent();
}

void Session::measure_surfaces(const Row& finest) {
  const std::string reference = kept("surface", finest.trial, ".ply");
  std::vector<Row*> rows;
  for (Row& row : study_.rows)
    if (row.found.ok() && row.repeat == 1 && fs::exists(kept("surface", row.trial, ".ply")))
      rows.push_back(&row);
  // Sizes first: where the time ends it is the other choices that go without.
  std::stable_partition(rows.begin(), rows.end(),
                        [](const Row* row) { return row->trial.sweep == "resolution"; });
  double slowest = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double share = left_to_look() / static_cast<double>(rows.size() - r), began = spent();
    if (left_to_look() < 1.5 * slowest || share <= 0) {
      study_.notes.push_back(fmt::format("{} of {} surfaces were not compared: the budget was spent.",
                                         rows.size() - r, rows.size()));
      return;
    }
    const SurfaceDistance found =
        surface_distance(kept("surface", rows[r]->trial, ".ply"), reference, in(share));
    rows[r]->surface_rms = found.rms;
    rows[r]->surface_hausdorff = found.hausdorff;
    slowest = std::max(slowest, spent() - began);
  }
}

void Session::measure_lags(const Row& finest) {
  if (!study_.facts.timed || study_.facts.probes.empty()) return;
  const std::string probe = study_.facts.probes.front();
  const History reference = read_history(kept("history", finest.trial, ".csv"));
  for (Row& row : study_.rows) {
    const std::string path = kept("history", row.trial, ".csv");
    if (!row.found.ok() || row.repeat > 1 || !fs::exists(path)) continue;
    const History history = read_history(path);
    row.lag = lag(history.time, probe_motion(history, probe), reference.time, probe_motion(reference, probe));
  }
}

// The coarsest, one in the middle and the finest but one of the sizes, against the finest.
void Session::draw_pictures(const Row& finest) {
  std::vector<const Row*> rows;
  for (const Row& row : study_.rows)
    if (row.found.ok() && row.trial.sweep == "resolution" && row.repeat == 1 && &row != &finest)
      rows.push_back(&row);
  if (rows.size() > 3) rows = {rows.front(), rows[(rows.size() - 1) / 2], rows.back()};
  const Quantity* largest = finest.found.find("largest displacement");
  if (largest == nullptr || !(largest->value > 0)) return;
  for (const Row* row : rows) {
    if (left_to_look() <= 0) {
      study_.notes.emplace_back("Pictures were left out: the budget was spent.");
      return;
    }
    const std::string surface = (folder_->path() / "error.ply").string();
    const std::string png = (folder_->path() / "error.png").string();
    write_error_surface(kept("surface", row->trial, ".ply"), kept("surface", finest.trial, ".ply"),
                        largest->value, surface);
    ChildOptions options;
    options.log = folder_->path() / "picture.log";
    options.deadline = in(left_to_look());
    const ChildRun run = run_child({own_program("flexel"), "picture", surface, "-o", png, "--color",
                                    kErrorAttribute, "--size", "560x420", "--quiet"},
                                   options);
    if (run.exit_code != 0) {
      study_.notes.push_back("The picture of " + row->trial.label + " could not be drawn.");
      continue;
    }
    const Bytes bytes = read_all(png);
    study_.pictures.push_back({fmt::format("{}, {} cells", row->trial.label, human_count(row->found.size())),
                               {reinterpret_cast<const char*>(bytes.data()), bytes.size()}});
  }
}

// The finest run as flexel view shows it.
void Session::draw_viewer() {
  const fs::path body = folder_->path() / kFinestBody, html = folder_->path() / kViewer;
  if (!fs::exists(body)) return;
  if (left_to_look() <= 0) {
    study_.notes.emplace_back("The page of the finest run was left out: the budget was spent.");
    return;
  }
  ChildOptions options;
  options.log = folder_->path() / "viewer.log";
  options.deadline = in(left_to_look());
  const ChildRun run =
      run_child({own_program("flexel"), "view", body.string(), "--html", html.string(), "--quiet"}, options);
  if (run.exit_code == 0) {
    const Bytes bytes = read_all(html.string());
    study_.viewer.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return;
  }
  const std::string why = error_in_log(options.log);
  study_.notes.push_back("The page of the finest run was left out: " +
                         (why.empty() ? "the budget was spent." : why));
}

void Session::finish() {
  progress_.stage("page");
  if (const Row* finest = finest_row()) {
    const Row reference = *finest;
    measure_lags(reference);
    // Reading surfaces heeds the interrupt, which has come already.
    try {
      if (!interrupted_) draw_viewer();
      if (!interrupted_) draw_pictures(*finest);
      if (!interrupted_) measure_surfaces(reference);
    } catch (const Interrupted&) {
      note_interrupt();
    } catch (const InputError& error) {
      study_.notes.push_back(fmt::format("Surfaces are not compared: {}", error.what()));
      progress_.warn(study_.notes.back());
    }
  }
  note_against();
  conclude(study_, wanted_.references);
  study_.spent = spent();
  write_all();
  progress_.finish();
  for (const std::string& sentence : study_.sentences) progress_.say(sentence);
}

void Session::write_all() {
  std::map<std::string, std::string> plots;
  try {
    plots = draw_plots(study_, folder_->path());
  } catch (const InputError& error) {
    study_.notes.push_back(std::string("The plots are left out: ") + error.what());
    progress_.warn(study_.notes.back());
  }
  const auto path = [&](const char* name) { return (wanted_.output / name).string(); };
  OutputsTogether outputs({path("study.csv"), path("study.json"), path(kViewer), path("study.html")});
  if (columns_) {
    std::string csv = csv_header(*columns_);
    for (std::size_t r = 0; r < study_.rows.size(); ++r) csv += csv_line(r + 1, study_.rows[r], *columns_);
    write_text(csv, path("study.csv"));
  }
  write_text(study_json(study_), path("study.json"));
  if (!study_.viewer.empty()) write_text(study_.viewer, path(kViewer));
  write_text(page(study_, plots), path("study.html"));
  outputs.appear();
  std::istringstream lines(prediction_table(study_));
  for (std::string line; std::getline(lines, line);) progress_.say(line);
}

}  // namespace flexel::study
