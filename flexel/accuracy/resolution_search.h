// The size of the lattice where the command line gives none (docs/guide/deform.md, "How exact, how long"): by
// default an error of 5 % within about 20 s; `flexel deform --accuracy 2%` and `--within 10s` ask for others.
//
// The compared quantities: the displacement of each probe along its direction in the last run; where no probe
// moves, that of the point of the surface that moves most; and, where a [[move]] drives the part, the
// elastic energy. The error of a single run is that of its error bars (simulate/estimate/error_bars.h).
// Beside a coarser run i - 1, at the ratio r of the spacings, the error of run i is
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
#include "flexel/accuracy/accuracy_report.h"
#include "flexel/accuracy/solved_run.h"
#include "mapping/types/result.h"
#include "simulate/result/result.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::commands {

// Asked of a run when its lattice is made: whether so many cells are to be solved.
using GoesOn = std::function<bool(std::size_t cells)>;
// Runs the stages at `size`; nothing: makes a lattice of a usual count of cells and no more (of the run, `size` says at
// which one). Where `goes_on` says no, nor is anything solved: the run is `given_up`.
using SolveAt = std::function<SolvedRun(std::optional<double> size, const GoesOn& goes_on)>;

// Makes runs until the goal is met, or the next would take too long or need too much memory, or four finer
// ones did not help. Returns the last good one. Throws what the first sizes threw where none can be solved.
[[nodiscard]] SolvedRun choose_resolution(const AccuracyGoal& goal, const SolveAt& solve,
                                          AccuracyReport& report, Progress& progress);

// s, of all threads of this process so far.
[[nodiscard]] double processor_seconds();

// How many times as long as on a machine that nobody else uses this process took since `began`, near its start: from 1 to 3.
[[nodiscard]] double slowed_by_others(std::chrono::steady_clock::time_point began);

[[nodiscard]] double seconds_since(std::chrono::steady_clock::time_point began);

// The preferred number (ISO 3: 10 or 20 to a decade) that is nearest, or the next one above.
enum class Rounded { nearest, up };
[[nodiscard]] double preferred_number(double value, int to_a_decade, Rounded rounded);

// m: about a fifth of the matter of all parts lies in thinner walls.
[[nodiscard]] double wall_thickness(const voxelize::VoxelizeResult& voxels);

// Largest difference of two mappings of the same run, as a share of the largest displacement.
[[nodiscard]] double mapping_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

}  // namespace flexel::commands
