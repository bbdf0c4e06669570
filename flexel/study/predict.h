// Predicts time and memory of the next run from earlier runs.
//
// Model: each stage takes seconds = c + a x^p, x the cells (of stages that step in time, cells times steps);
// each program takes bytes = c + a n. c, a and p are fitted by least squares of the relative error, with more
// weight on larger runs and a weak prior: constants measured once, or the fit of another kind of run.
#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "flexel/study/runs/runner.h"

namespace flexel::study {

// seconds (or bytes) = constant + slope x^power
struct PowerLaw {
  double constant = 0, slope = 0, power = 1;
  [[nodiscard]] double at(double x) const;
};

struct Observation {
  double x = 0, y = 0;  // both above 0
};

// The law that fits best among powers near the prior's (`powers_vary`), or of its own power. Without
// observations the prior.
[[nodiscard]] PowerLaw fit(const std::vector<Observation>& observations, const PowerLaw& prior,
                           bool powers_vary);

struct RunSize {
  double cells = 0;  // at centre placement elements
  double steps = 1;  // in time
};

struct Prediction {
  double seconds = 0;  // wall
  double bytes = 0;    // the largest of the programs
  std::vector<Stage> stages;

  // Of a run so many times as costly.
  [[nodiscard]] Prediction scaled(double factor) const { return {factor * seconds, factor * bytes, stages}; }
};

// Kinds of runs whose costs follow laws of their own: CalculiX's direct solver, cells being tetrahedra; and
// `flexel deform`, which has all stages in one process, its memory being that of program 0, and names them
// "voxelize", "solve" (with what assembles), "error bars" and "map".
inline constexpr const char* kCalculix = "calculix";
inline constexpr const char* kOneProcess = "one process";

class Predictor {
 public:
  // A run that succeeded. `kind` separates runs of different cost at the same size: the model, the
  // integrator, the threads; "" is the ordinary one, which is the prior of all others but of kCalculix and
  // kOneProcess.
  void add(const std::string& kind, const RunSize& size, const RunResult& run);
  // Never throws; with no run so far it is the prior alone, good to a factor of a few.
  [[nodiscard]] Prediction predict(const std::string& kind, const RunSize& size) const;
  [[nodiscard]] bool knows(const std::string& kind) const { return kinds_.count(kind) > 0; }

 private:
  struct Kind {
    std::map<std::string, std::vector<Observation>> stages;
    std::array<std::vector<Observation>, 3> memory;
  };
  [[nodiscard]] PowerLaw stage_law(const std::string& kind, const std::string& stage, bool timed) const;
  [[nodiscard]] PowerLaw memory_law(const std::string& kind, std::size_t program) const;
  std::map<std::string, Kind> kinds_;
};

}  // namespace flexel::study
