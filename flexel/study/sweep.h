// The configurations of a study and their order: first a ladder of sizes, as fine as time and memory allow,
// then the other choices, cheapest first. Those run at one size, which resolves the walls, has kFewestOfUse
// cells or more and takes a small share of the budget.
#pragma once
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "flexel/study/predict.h"
#include "flexel/study/runs/runner.h"
#include "flexel/study/runs/scene_edit.h"

namespace flexel::study {

// A configuration with its place in the study.
struct Trial {
  std::string sweep;  // "resolution", "model", "mapping", "tolerance", "threads", "integrator", "step",
                      // "effect", "calculix"
  std::string label;  // "1.5 mm", "springs 3 mm", "without gravity"
  Configuration configuration;

  // Of the predictor: what makes it cost differently at the same size.
  [[nodiscard]] std::string kind() const;
};

// What was left out, and why.
struct LeftOut {
  Trial trial;
  Prediction predicted;
  std::string why;
};

// Rounded to three digits.
[[nodiscard]] double rounded(double size);

// How many tetrahedra of an edge gmsh puts into a cube of that edge, about, on bulky parts.
inline constexpr double kTetrahedraInCube = 6;

// Sizes from coarse to fine [m], at which a wall of the given thickness is 1, 2, 3, 4, 6, 8, 12, ... cells;
// each of three digits. From the first with about `fewest` cells, `cells_at` (spacing) of them.
[[nodiscard]] std::vector<double> ladder_of_sizes(double wall, double spacing, double cells_there,
                                                  double fewest, int rungs);

inline constexpr std::size_t kFewestOfUse = 2000;

class Sweep {
 public:
  // `first`: the configuration that the user would have without choosing; its size is not used. `sizes`: the
  // ladder. `budget` [s] decides what the middle is.
  Sweep(SceneFacts facts, Configuration first, const std::vector<double>& sizes, double budget, int cores);

  // CalculiX beside it: edges of tetrahedra [m] from coarse to fine, of a part of `volume` [m^3].
  void set_against(std::vector<double> edges, double volume);

  // The trials that can be run next.
  [[nodiscard]] std::vector<Trial> open() const;
  // What the next run of this trial takes; of so many cells (elements where there are none), once they are
  // counted.
  [[nodiscard]] Prediction predict(const Trial& trial, std::optional<std::size_t> counted = {}) const;
  // The run ended (well or not).
  void done(const Trial& trial, const RunResult& found);
  // The trial is not going to be run; of the ladder, nor is any finer size. The same of CalculiX's.
  void leave_out(const Trial& trial);

  [[nodiscard]] const SceneFacts& facts() const { return facts_; }

 private:
  struct Rung {
    double size = 0;
    bool done = false;
    std::optional<RunSize> found;  // of a run that went well
    double spacing = 0, step = 0, wall = 0, cpu = 0, thin_matter = 0;
  };
  [[nodiscard]] RunSize size_of(const Trial& trial) const;
  // What a run takes on other threads over what one on every core takes.
  [[nodiscard]] double thread_factor(const Trial& trial) const;
  [[nodiscard]] bool climbing() const;  // the ladder is not at its end
  [[nodiscard]] std::optional<std::size_t> middle() const;
  void add_models(std::vector<Trial>& trials, std::size_t rung) const;
  void add_switches(std::vector<Trial>& trials, std::size_t rung) const;
  void add_timed(std::vector<Trial>& trials, const Rung& rung) const;
  void add_effects(std::vector<Trial>& trials, const Rung& rung) const;
  [[nodiscard]] std::optional<Trial> next_against() const;
  [[nodiscard]] Trial trial(const std::string& sweep, const std::string& choice, double size,
                            const Configuration& configuration) const;

  SceneFacts facts_;
  Configuration first_;
  std::vector<Rung> rungs_;
  double budget_ = 0;
  int cores_ = 1;
  bool ladder_ended_ = false;
  std::vector<double> edges_;                                // of CalculiX's tetrahedra, m
  double volume_ = 0;                                        // m^3
  std::optional<std::pair<double, double>> edge_and_cells_;  // of its last run that went well
  bool against_ended_ = false;
  std::set<std::string> closed_;  // labels of trials that are done or left out
  Predictor predictor_;
};

}  // namespace flexel::study
