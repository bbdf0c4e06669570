// The requested accuracy, the runs that were tried, and the report on them.
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace flexel::commands {

struct AccuracyGoal {
  std::optional<double> error;   // share, of --accuracy
  std::optional<double> within;  // s, of --within: from `began` to the end
  // Nobody asked: sizes are chosen by the time that the machine would take if nobody else used it, so that
  // the same command chooses the same one when it is busy.
  bool by_default = false;
  std::chrono::steady_clock::time_point began;
  bool driven = false;  // by moves: the elastic energy counts
};

struct TriedRun {
  double size = 0;  // m
  std::size_t cells = 0;
  double seconds = 0;
  double memory = 0;                                          // bytes, of the process until its end
  std::optional<double> predicted_seconds, predicted_memory;  // before it; nothing for the first
  std::optional<double> error;                                // share
  std::string of;    // the quantity that is worst: "probe tip", "largest displacement"
  double order = 1;  // by which the error falls with the spacing
  std::vector<std::pair<std::string, double>> found;  // quantities by name: m, of energies J
  std::string failure;                                // why there is nothing at this size
};

struct AccuracyReport {
  AccuracyGoal goal;
  std::vector<TriedRun> runs;    // in the order they were made; the last is the one that counts
  std::string stopped;           // why no finer run was made, where the goal is not met
  std::string method;            // of mapping
  std::string dropped_model;     // why the model for thin walls, tried first, is not the one that answered
  bool tried_quadratic = false;  // beside a rough first answer of model `cells`, in vain
  double seconds = 0;            // of all runs, until the result was written
  // What to ask for next, with the time that it is expected to take: "--accuracy 2% takes about 40 s".
  std::string advice;
  [[nodiscard]] bool met() const;
  // One sentence for people.
  [[nodiscard]] std::string sentence() const;
  [[nodiscard]] std::string json() const;  // docs/reference/summary.md, "accuracy"
};

// In words that --size takes: "1.25mm".
[[nodiscard]] std::string size_text(double metres);

}  // namespace flexel::commands
