// The analysis of a study's runs: reference values and their uncertainty, errors, the Pareto frontier of
// error against time, the cost of accuracy, and the sentences of the report. No files, no processes.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flexel/study/runs/runner.h"

namespace flexel::study {

// What the runs are compared with, for one quantity.
struct Reference {
  std::string name, unit;
  double value = 0;
  double uncertainty = 0;       // the truth is expected within value +- this; 0 where it was given
  std::optional<double> order;  // observed; nothing where the values do not approach a limit evenly
  std::string from;             // "given", "extrapolated from 3 sizes", "finest of 2 sizes" ...
  bool decides = false;         // it counts for the error of a run
  std::string doubt;            // why no error can be measured against it; "": one can
};

// One quantity over the sizes of a sweep; the coarsest first.
struct SizeValue {
  double spacing = 0;  // m
  double value = 0;
  bool resolved = true;  // at most kThinMatter of the matter lies in walls of fewer than two cells
};
inline constexpr double kThinMatter = 0.2;  // as the error bars have it

// The reference value of a quantity, by Richardson extrapolation from the finest three resolved sizes, with
// the observed order, at most 2. Its uncertainty is the grid convergence index (simulate/result/estimate.h
// gives sources and exceptions) and, with four sizes, at least half the difference from the extrapolation of
// the next coarser three. An observed order above 3 is chance: the reference is then the finest value, within
// three times the larger difference. With fewer than three resolved sizes, or an uncertainty above a quarter
// of the value, there is `doubt`: the finest value within three times the largest difference; a single one
// within its own size.
[[nodiscard]] Reference extrapolate(const std::string& name, const std::string& unit,
                                    const std::vector<SizeValue>& values);

// The largest relative error among the deciding quantities that the run has, and the largest relative
// uncertainty of those; nothing where there is none, or where one of them is in doubt.
struct RunError {
  double error = 0, uncertainty = 0;
};
[[nodiscard]] std::optional<RunError> error_of(const RunResult& run,
                                               const std::vector<Reference>& references);

// A configuration and what its runs found.
struct Point {
  std::string label;    // short, for plots: "1.5 mm", "springs 3 mm"
  std::string sweep;    // "resolution", "model", ...; the curve that it belongs to
  std::string options;  // what a user writes to have it: "--size 1.5mm --method affine"
  double seconds = 0;   // median wall time
  double memory = 0;    // bytes, the largest
  std::optional<RunError> error;
  bool choosable = true;  // false: not the user's problem any more (an effect left out), or not ours
};

// Indices of the points that no other beats in both time and error (errors below the uncertainty count as
// that), by time.
[[nodiscard]] std::vector<std::size_t> frontier(const std::vector<Point>& points);

// The cheapest choosable point whose error with its uncertainty is at most `target`.
[[nodiscard]] std::optional<std::size_t> cheapest_within(const std::vector<Point>& points, double target);

// The factor in time that a tenth of the error costs: least squares of log time over log error, of the points
// of sweep "resolution" whose error is above its uncertainty. Nothing with fewer than two of them, when
// their errors lie within a factor 2, or when more time does not give less error.
[[nodiscard]] std::optional<double> cost_of_tenfold(const std::vector<Point>& points);

// "For 1 % use --size 1.5mm: 3.1 s, 420 MB. Ten times the accuracy costs 22 times the time."
[[nodiscard]] std::vector<std::string> sentences(const std::vector<Point>& points);

// What the sizes know of each deciding quantity, and what of all their values is known only as a range, where
// one of them is in doubt: "The error of no run is known: ...". Nothing where none is.
[[nodiscard]] std::vector<std::string> doubtful_sentences(const std::vector<Reference>& references);

// The range in which a size's value leaves the limit, by the sizes up to it, the coarsest first:
// half its width. As extrapolate() has it, about its own value.
[[nodiscard]] double half_range(const std::vector<SizeValue>& values);

// One quantity by another program beside Flexel's value.
struct Agreement {
  Reference ours, theirs;  // theirs extrapolated from its own sizes
  double finest = 0;       // what its finest run found
  bool agree = false;      // the two ranges meet
};
[[nodiscard]] Agreement compare(const Reference& ours, const std::vector<SizeValue>& theirs);

// "For 1 % CalculiX takes tetrahedra of 3 mm: 2.1 s with meshing, 100 MB.": of the points of sweep
// "calculix"; where none keeps 1 %, for what the best one keeps. Nothing without such points.
[[nodiscard]] std::string against_sentence(const std::vector<Point>& points);

// Median, and how well it is known: 1.2533 s / sqrt(n) over the median, s the standard deviation (the
// standard error of a normal sample's median); infinite for fewer than three.
struct Median {
  double value = 0, relative_error = 0;
};
[[nodiscard]] Median median(std::vector<double> values);

// "1.5mm", "750um": a length as options take it, of three digits.
[[nodiscard]] std::string option_length(double metres);
// "3.1 s", "12 ms", "4 min 10 s".
[[nodiscard]] std::string human_seconds(double seconds);

}  // namespace flexel::study
