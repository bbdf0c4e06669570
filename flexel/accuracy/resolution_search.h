// The size of the lattice where the command line gives none (docs/guide/deform.md, "How exact, how long"): by
// default an error of 5 % within about 20 s; `flexel deform --accuracy 2%` and `--within 10s` ask for others.
//
// The compared quantities: the displacement of each probe along its direction in the last run; where no probe
// moves, that of the vertex that moves most; and, where a [[move]] drives the part, the elastic energy. The
// error of a single run is that of its error bars (simulate/estimate/error_bars.h). Beside a coarser run i -
// 1, at the ratio r of the spacings, the error of run i is
//     three runs that approach a limit:           their grid convergence index (simulate/result/estimate.h)
//     order p <= 2.1 of the run's own error bars: 1.25 |f_i - f_(i-1)| / (r^p - 1), p between 1 and 2
//     else:                                       3 |f_i - f_(i-1)| / (r - 1)
// (safety factors of Roache, J. Fluids Eng. 116, 1994), and never less than the run's own error bar. The
// worst quantity counts. Runs whose cells are wider than walls that hold over a fifth of the matter are not
// compared, as in simulate/estimate/error_bars.cpp.
#pragma once
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/program/progress.h"
#include "mapping/types/result.h"
#include "simulate/result/result.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::commands {

// One run at one size, its body deformed.
struct SolvedRun {
  double size = 0;  // m, asked for
  voxelize::VoxelizeResult voxels;
  simulate::SimulateResult simulated;
  std::vector<Vec3> mapped;  // (vertices) m
  double voxelize_seconds = 0, map_seconds = 0;
  double processor_seconds = 0;       // of all of it and all threads; 0: not known
  double wall = 1e300;                // m: a fifth of the matter lies in thinner walls
  std::vector<std::string> warnings;  // said while it ran, held back
  bool given_up = false;
};

// Asked of a run when its lattice is made: whether so many cells are to be solved.
using GoesOn = std::function<bool(std::size_t cells)>;
// Runs the stages at `size`; nothing: makes a lattice of a usual count of cells and no more. Where `goes_on`
// says no, nor is anything solved: the run is `given_up`.
using SolveAt = std::function<SolvedRun(std::optional<double> size, const GoesOn& goes_on)>;

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
  std::vector<TriedRun> runs;  // in the order they were made; the last is the one that counts
  std::string stopped;         // why no finer run was made, where the goal is not met
  std::string method;          // of mapping
  double seconds = 0;          // of all runs, until the result was written
  // What to ask for next, with the time that it is expected to take: "--accuracy 2% takes about 40 s".
  std::string advice;
  [[nodiscard]] bool met() const;
  // One sentence for the user.
  [[nodiscard]] std::string sentence() const;
  [[nodiscard]] std::string json() const;  // docs/reference/summary.md, "accuracy"
};

// Makes runs until the goal is met, or the next would take too long or need too much memory, or four finer
// ones did not help. Returns the last good one. Throws what the first sizes threw where none can be solved.
[[nodiscard]] SolvedRun choose_resolution(const AccuracyGoal& goal, const SolveAt& solve,
                                          AccuracyReport& report, Progress& progress);

// s, of all threads of this process so far.
[[nodiscard]] double processor_seconds();

[[nodiscard]] double seconds_since(std::chrono::steady_clock::time_point began);

// In words that --size takes: "1.25mm".
[[nodiscard]] std::string size_text(double metres);

// The preferred number (ISO 3: 10 or 20 to a decade) that is nearest, or the next one above.
enum class Rounded { nearest, up };
[[nodiscard]] double preferred_number(double value, int to_a_decade, Rounded rounded);

// m: about a fifth of the matter of all parts lies in thinner walls.
[[nodiscard]] double wall_thickness(const voxelize::VoxelizeResult& voxels);

// Largest difference of two mappings of the same run, as a share of the largest displacement.
[[nodiscard]] double mapping_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

}  // namespace flexel::commands
