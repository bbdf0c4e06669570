// A probe more than the scene's follows the material point that moved most, so that all lattices are asked
// about the same point. The largest stress may be elsewhere on each lattice.
#include "simulate/estimate/error_bars.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/error.h"
#include "base/human.h"
#include "base/program/progress_stretch.h"
#include "base/stop.h"
#include "formats/lattice/fields.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/estimate/narrow_region.h"

namespace flexel::simulate {
namespace {

constexpr double kThinWall = 2;     // cells
constexpr double kThinShare = 0.2;  // of the matter
// Two cells through a wall and one may agree by chance: a twisted bar is off by 16 % with either, by 8 % with three. So
// the only difference leaves at least so much of the value, in walls under three cells and in others.
constexpr double kFewCells = 3, kFewCellsLeave = 0.2, kOneDifferenceLeaves = 0.1;
// Of the value, at least, where values do not close in evenly: they may agree by chance.
constexpr double kUnevenLeaves = 3e-3;
constexpr int kAddedIterations = 20;  // of Newton, to twice those of the fine run
// Of the coarse runs: far below the differences between lattices.
constexpr double kCoarseTolerance = 1e-6;
// Of the time of the coarse runs: a lattice has an eighth of the cells of the finer one.
constexpr double kFirstRun = 8.0 / 9;

// What is asked of every lattice.
struct Answers {
  std::vector<Vec3> moved;  // m, the probes, then the point that moved most
  double energy = 0;        // J
  double stress = 0;        // Pa, the largest
};

Answers answers(const SimulateResult& result) {
  Answers found;
  for (const ProbeResult& probe : result.probes) found.moved.push_back(probe.displacement);
  found.energy = result.elastic_energy;
  if (result.stress) found.stress = result.stress->value;
  return found;
}

// The share of the matter in walls that thin, where it is too much for bars. The cells of model
// `quadratic` hold walls of any thickness.
std::optional<double> thin_walls(const Body& body, double cells, bool quadratic) {
  if (quadratic) return std::nullopt;
  const double share = share_of_thin_walls(body, cells);
  return share > kThinShare ? std::optional(share) : std::nullopt;
}

// Ratio of the spacings of two lattices of the same matter.
double ratio_of(const Body& fine, const Body& coarse) {
  double volumes = 0, weights = 0;
  for (std::size_t p = 0; p < fine.parts.size(); ++p) {
    const double cells = fine.parts[p].cell_end - fine.parts[p].cell_begin;
    volumes +=
        cells * std::log(coarse.parts[p].lattice.spacing.prod() / fine.parts[p].lattice.spacing.prod());
    weights += cells;
  }
  return std::exp(volumes / weights / 3);
}

// Throws InputError: the flat faces of a part of model `springs` gave its coarser cells another shape than a cube.
void refuse_uneven_cubes(const Body& coarse, const Scene& scene) {
  const std::vector<Model> models = models_of_parts(scene, coarse);
  for (std::size_t p = 0; p < models.size(); ++p) {
    const Vec3& h = coarse.parts[p].lattice.spacing;
    if (models[p] == Model::springs && h.maxCoeff() > (1 + 1e-6) * h.minCoeff())
      throw InputError(
          fmt::format("its cells of part \"{}\" would be no cubes, which model \"springs\" needs; where an "
                      "even number of cells fits between flat faces they are",
                      coarse.parts[p].name));
  }
}

// The coarser runs, as many as can be done.
class CoarseRuns {
 public:
  CoarseRuns(const Body& body, const Scene& scene, const SimulateOptions& options,
             const SimulateResult& result, const SolveCoarse& solve, Progress& progress)
      : options_(options),
        solve_(solve),
        progress_(progress),
        scene_(scene),
        quadratic_(QuadraticField::is_in(body)) {
    const StopWaits answered;
    const LargestDisplacement most = largest_displacement(body);
    Probe probe;
    probe.name = "largest displacement";
    probe.at = most.at;
    scene_.probes.push_back(probe);
    scene_.run.tolerance = std::max(scene.run.tolerance, kCoarseTolerance);
    scene_.run.newton_iterations =
        2 * std::max(result.newton_iterations, result.start_newton_iterations) + kAddedIterations;
    found_.push_back(answers(result));
    found_.back().moved.push_back(most.displacement);
    options_.explain = options_.estimate = false;
    options_.failed_output.clear();
    options_.cut_box = {};
    options_.hooks = hooks_on_coarser(options_.hooks);
  }

  // Adds one lattice; false, with the reason, where it cannot be done. A lattice whose cells are wider than
  // many walls says nothing beside a third one, nor beside a fine one that has not two cells through them:
  // both hold the matter, neither the shape, and may agree on a wrong value.
  bool add(const Body& finer, Body& coarse, std::string& reason) {
    try {
      coarse = coarsened(finer);
      refuse_uneven_cubes(coarse, scene_);
      if (thin_walls(coarse, 1, quadratic_)) {
        if (found_.size() > 1) throw InputError("walls are thinner than its cells");
        if (thin_walls(finer, kThinWall, quadratic_)) throw InputError("walls are thinner than two cells");
      }
      ratio_.push_back(ratio_of(finer, coarse));
      const bool first = found_.size() == 1;
      ProgressStretch stretch(progress_, first ? 0 : kFirstRun, first ? kFirstRun : 1);
      found_.push_back(answers(solve_(coarse, scene_, options_, stretch.inner())));
    } catch (const InputError& error) {
      reason = error.what();
    } catch (const DivergedError& error) {
      reason = error.what();
    } catch (const TimeoutError& error) {
      reason = error.what();
    }
    return reason.empty();
  }

  // The three values of a displacement along that on the finest lattice, or of the energy.
  [[nodiscard]] Sequence moved(std::size_t which) const {
    const Vec3& fine = found_[0].moved[which];
    const double length = fine.norm();
    return sequence([&](const Answers& each) {
      return length > 0 ? each.moved[which].dot(fine) / length : each.moved[which].norm();
    });
  }
  [[nodiscard]] Sequence stress() const {
    return sequence([](const Answers& each) { return each.stress; });
  }
  [[nodiscard]] Sequence energy() const {
    return sequence([](const Answers& each) { return each.energy; });
  }

 private:
  template <class Value>
  [[nodiscard]] Sequence sequence(const Value& value) const {
    Sequence result;
    for (std::size_t i = 0; i < 3; ++i) result.value[i] = value(found_[std::min(i, found_.size() - 1)]);
    for (std::size_t i = 0; i < 2; ++i) result.ratio[i] = ratio_[std::min(i, ratio_.size() - 1)];
    return result;
  }

  SimulateOptions options_;
  const SolveCoarse& solve_;
  Progress& progress_;
  Scene scene_;
  std::vector<Answers> found_;
  std::vector<double> ratio_;
  bool quadratic_;
};

// On the region, or a point of the box around it.
bool is_on(const Probe& probe, const std::vector<std::uint32_t>& region, const Body& body) {
  if (probe.where) {
    const std::vector<std::uint32_t> its = resolve(*probe.where, body).polygons;
    return std::any_of(its.begin(), its.end(), [&](std::uint32_t each) {
      return std::binary_search(region.begin(), region.end(), each);
    });
  }
  Eigen::AlignedBox3d box;
  for (const std::uint32_t polygon : region)
    for (const std::uint32_t corner : body.surface.polygon(polygon))
      box.extend(body.surface.vertices[corner]);
  const Part& part = body.parts[body.surface.polygon_part(region.front())];
  return probe.at && box.exteriorDistance(*probe.at) < part.lattice.spacing.mean();
}

// No bar of the largest displacement, or of a probe on the loaded region, is narrower than what the surface gives way there
// unseen by the lattices: they spread the load over a cell each, and may agree on too little.
void hold_indentations(const Body& body, const Scene& scene, ErrorBars& errors) {
  for (const UnresolvedIndentation& each : indentations_under_two_cells(body, scene)) {
    bool widened = false;
    for (ErrorBar& bar : errors.bars) {
      if (bar.of == ErrorBar::Of::elastic_energy) continue;
      if (bar.of == ErrorBar::Of::probe && !is_on(scene.probes[bar.probe], each.polygons, body)) continue;
      if (bar.bar.half_width >= each.depth) continue;
      bar.bar.half_width = each.depth;
      widened = true;
    }
    if (!widened) continue;
    if (!errors.note.empty()) errors.note += "; ";
    errors.note += fmt::format(
        "the load \"{}\" acts on a narrow region (a strip of its area and rim is {} wide, under two cells), "
        "which may sink in by {} "
        "more: use a smaller spacing",
        each.load, human_length(each.width), human_length(each.depth));
  }
}

// Its order is 2 and more inside the matter and 1 at clamped edges and notches, which count last.
Bar of_quadratic(Bar bar, const Sequence& values) {
  bar.half_width =
      std::max(bar.half_width, std::abs(values.value[0] - values.value[1]) / (values.ratio[0] - 1));
  return bar;
}

// So much of the value.
Bar at_least(double share, Bar bar) {
  bar.half_width = std::max(bar.half_width, share * std::abs(bar.extrapolated));
  return bar;
}

std::string first_sentence(const std::string& text) {
  return text.substr(0, text.find(": add "));
}

// `least`: of the value, or 0.
std::string of_one_difference(const std::string& reason, double least) {
  return fmt::format(
      "a lattice four times as coarse is of no use ({}): the bars are three times the only difference{}",
      first_sentence(reason),
      least > 0 ? fmt::format(" and at least {:.0f} % of the value", 100 * least) : "");
}

}  // namespace

double refinement_for_walls(const Body& body) {
  constexpr double kStep = 1.25, kMost = 64;
  double finer = 2;
  while (finer < kMost && thin_walls(body, kThinWall / finer, QuadraticField::is_in(body))) finer *= kStep;
  return finer;
}

ErrorBars estimate_errors(const Body& body, const Scene& scene, const SimulateOptions& options,
                          const SimulateResult& result, const SolveCoarse& solve, Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  ErrorBars errors;
  errors.cells.push_back(body.cell_count());
  const bool quadratic = QuadraticField::is_in(body);
  CoarseRuns runs(body, scene, options, result, solve, progress);
  Body half, quarter;
  std::string reason;
  if (!runs.add(body, half, reason)) {
    errors.note = "a lattice twice as coarse cannot be solved: " + first_sentence(reason);
    return errors;
  }
  errors.cells.push_back(half.cell_count());
  bool wide = false;
  double least = kUnevenLeaves;  // of the value, of bars without an order
  if (runs.add(half, quarter, reason)) {
    errors.cells.push_back(quarter.cell_count());
    if (const std::optional<double> thin = thin_walls(body, kThinWall, quadratic)) {
      wide = true;
      errors.note = fmt::format(
          "{:.0f} % of the matter lies in walls under 2 cells: the bars are three times the "
          "largest difference; use a smaller spacing",
          100 * *thin);
    } else if (const std::string narrow = support_under_two_cells(body, scene); !narrow.empty()) {
      wide = true;
      errors.note = narrow + ": the bars are three times the largest difference; use a smaller spacing";
    }
  } else {
    wide = true;
    if (!quadratic) least = thin_walls(body, kFewCells, quadratic) ? kFewCellsLeave : kOneDifferenceLeaves;
    errors.note = of_one_difference(reason, quadratic ? 0 : least);
  }
  const auto bar = [&](const Sequence& values) {
    const Bar found = wide ? wide_bar(values) : richardson(values);
    return quadratic ? of_quadratic(found, values) : found.order ? found : at_least(least, found);
  };
  for (std::size_t p = 0; p <= result.probes.size(); ++p) {
    const Sequence values = runs.moved(p);
    const bool probe = p < result.probes.size();
    errors.bars.push_back({probe ? ErrorBar::Of::probe : ErrorBar::Of::largest_displacement, probe ? p : 0,
                           probe ? result.probes[p].name : "", values.value[0], bar(values)});
  }
  hold_indentations(body, scene, errors);
  const Sequence energy = runs.energy();
  errors.bars.push_back({ErrorBar::Of::elastic_energy, 0, "", energy.value[0], bar(energy)});
  const Sequence stress = runs.stress();
  if (quadratic && stress.value[0] > 0)
    errors.von_mises = {stress.value, field_stress_bar(stress, errors.cells.size(), result.stress->doubt,
                                                       !result.stress->beside.empty())};
  else if (!wide && stress.value[0] > 0)
    errors.von_mises = {stress.value, stress_bar(stress, !result.stress->beside.empty())};
  errors.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return errors;
}

}  // namespace flexel::simulate
