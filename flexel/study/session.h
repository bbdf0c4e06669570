// One study, from the first coarse run to the page.
#pragma once
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/study/study.h"

namespace flexel::study {

constexpr const char* kOwnScene = "study-scene.toml";
constexpr const char* kFinestBody = "finest.vtu";  // in the study's temporary folder

struct Assignment {
  Case study_case;
  bool writes_scene = false;            // the case's scene is kOwnScene in `output`, which the study writes
  std::vector<std::string> part_names;  // for people
  double budget = 120;                  // s
  std::filesystem::path output;         // a folder that exists
  std::vector<Reference> references;    // given ones
  bool against_calculix = false;
};

class Session {
 public:
  Session(const Assignment& wanted, Progress& progress);
  // Throws InputError: the part or the scene cannot be run at all, the budget is too small for one run. An
  // interrupt ends the runs; what is done is written.
  void run();
  [[nodiscard]] bool interrupted() const { return interrupted_; }

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] Sweep look();
  void look_at_other(Sweep& sweep, double volume);
  void run_all(Sweep& sweep);
  [[nodiscard]] std::ptrdiff_t sizes_done(const std::string& sweep) const;
  bool run_cheapest(Sweep& sweep);
  void repeat_all(Sweep& sweep);
  [[nodiscard]] std::string why_not(const Trial& trial, const Prediction& prediction) const;
  void run_one(Sweep& sweep, const Trial& trial, Prediction predicted);
  [[nodiscard]] RunResult run_trial(const Trial& trial, bool first, const RunOptions& asked) const;
  void leave_out(Sweep& sweep, const Trial& trial, const Prediction& prediction, const std::string& why);
  void note_against();
  void note_interrupt();
  void append(const Row& row);
  void finish();
  void measure_surfaces(const Row& finest);
  [[nodiscard]] Deadline in(double seconds) const;  // from now
  void measure_lags(const Row& finest);
  void draw_pictures(const Row& finest);
  void keep_finest_body(const Trial& trial) const;
  void draw_viewer();
  void write_all();
  [[nodiscard]] const Row* finest_row() const;
  [[nodiscard]] std::string kept(const char* what, const Trial& trial, const char* ending) const;
  [[nodiscard]] double spent() const;
  [[nodiscard]] double left() const;          // s, for runs
  [[nodiscard]] double left_to_look() const;  // s, until the page itself has to be made
  [[nodiscard]] Deadline deadline() const;    // when those end

  const Assignment& wanted_;
  Progress& progress_;
  const Clock::time_point begin_ = Clock::now();
  std::optional<TemporaryFolder> folder_;
  std::optional<std::vector<Quantity>> columns_;  // of study.csv, once a run has shown them
  std::vector<Row> waiting_;                      // failed before that
  std::map<std::string, std::size_t> numbers_;    // of labels, for the names of kept files
  Study study_;
  bool large_deflection_ = false;  // of CalculiX
  bool interrupted_ = false;
};

}  // namespace flexel::study
