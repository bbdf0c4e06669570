// A probe more than the scene's follows the material point that moved most, so that all lattices are asked
// about the same point. The largest stress may be elsewhere on each lattice.
#include "simulate/estimate/error_bars.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>

#include "base/error.h"
#include "base/human.h"
#include "base/program/progress_stretch.h"
#include "base/stop.h"
#include "formats/lattice/fields.h"
#include "formats/lattice/quadratic_field.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/estimate/coarsen_pieces.h"
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

// How many times as fine a lattice needs to be for two cells through most walls, to a quarter; at least twice, and
// that in model `quadratic`, whose cells hold walls of any thickness.
double refinement_for_walls(const Body& body, bool quadratic) {
  constexpr double kStep = 1.25, kMost = 64;
  double finer = 2;
  while (finer < kMost && thin_walls(body, kThinWall / finer, quadratic)) finer *= kStep;
  return finer;
}

// The body's largest displacement; of all pieces where it is in pieces.
LargestDisplacement largest_of_whole(const Body& body) {
  if (!other_pieces()) return largest_displacement(body);
  std::vector<Vec3> moved(body.element_count());
  for (std::size_t e = 0; e < moved.size(); ++e) moved[e] = body.position[e] - body.rest[e];
  const SurfacePiece piece{other_pieces()->polygons_with_cells(), other_pieces()->own_vertices()};
  LargestDisplacement largest = largest_displacement(body, moved, &piece);
  std::array<double, 6> told;
  Eigen::Map<Vec3>(told.data()) = largest.displacement;
  Eigen::Map<Vec3>(told.data() + 3) = largest.at;
  (void)other_pieces()->take_of_largest(largest.value(), told);
  largest.displacement = Eigen::Map<Vec3>(told.data());
  largest.at = Eigen::Map<Vec3>(told.data() + 3);
  return largest;
}

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

// Held and loaded regions that the finest lattice does not resolve.
struct NarrowRegions {
  NarrowRegions(const Body& body, const Scene& scene)
      : support(support_under_two_cells(body, scene)), loads(indentations_under_two_cells(body, scene)) {
    for (const UnresolvedIndentation& each : loads) {
      std::vector<std::uint8_t>& on = probes.emplace_back();
      for (const Probe& probe : scene.probes) on.push_back(is_on(probe, each.polygons, body));
    }
  }
  std::string support;
  std::vector<UnresolvedIndentation> loads;
  std::vector<std::vector<std::uint8_t>> probes;  // (loads x probes) 1: on the load's region
};

// What is asked of a lattice that a coarser one is made of.
struct Finer {
  const std::vector<Part>& parts;
  std::function<Body()> coarsened;
  std::function<bool()> has_thin_walls;  // of under two cells
};

Finer finer(const Body& body, bool quadratic) {
  return {body.parts, [&body] { return coarsened(body); },
          [&body, quadratic] { return thin_walls(body, kThinWall, quadratic).has_value(); }};
}

// What is asked of the finest lattice. Of a body in pieces all processes find it, and the first goes on with it.
class Finest {
 public:
  Finest(const Body& body, const Scene& scene)
      : cells(whole_cell_count(body)),
        most(largest_of_whole(body)),
        narrow(body, scene),
        quadratic(QuadraticField::is_in(body)),
        body_(body) {
    if (!other_pieces()) return;
    try {
      half_ = coarsened_from_pieces(body);
    } catch (const InputError& error) {
      no_half_ = error.what();
    }
    with_moments_ = have_moments(body);
    for (const double thickness : {kThinWall, kFewCells}) found_[thickness] = thin(thickness);
    if (found_[kThinWall]) refinement_ = refinement_for_walls(body, quadratic);
  }

  // The share of the matter in walls under so many cells, kThinWall or kFewCells, where it is too much for bars.
  [[nodiscard]] std::optional<double> thin(double thickness) const {
    const auto found = found_.find(thickness);
    return found != found_.end() ? found->second : thin_walls(body_, thickness, quadratic);
  }
  [[nodiscard]] double refinement() const {
    return found_.empty() ? refinement_for_walls(body_, quadratic) : refinement_;
  }
  [[nodiscard]] Finer as_finer() {
    if (found_.empty()) return finer(body_, quadratic);
    return {body_.parts, [this] { return half(); }, [this] { return thin(kThinWall).has_value(); }};
  }
  // `half`: what its coarsened() gave. Of pieces it has no moments, and is coarsened as one that has.
  [[nodiscard]] Finer half_as_finer(const Body& half) const {
    Finer made = finer(half, quadratic);
    if (with_moments_)
      made.coarsened = [&half] {
        return coarsening(half, choose_grids(half, half.parts[0], face_pairs(half), true)).body;
      };
    return made;
  }

  const std::size_t cells;
  const LargestDisplacement most;
  const NarrowRegions narrow;
  const bool quadratic;

 private:
  [[nodiscard]] Body half() {
    if (!no_half_.empty()) throw InputError(no_half_);
    return std::move(half_);
  }

  const Body& body_;
  std::map<double, std::optional<double>> found_;  // of a body in pieces, by thickness
  bool with_moments_ = false;                      // likewise
  double refinement_ = 2;                          // likewise
  Body half_;
  std::string no_half_;
};

// Ratio of the spacings of two lattices of the same matter.
double ratio_of(const std::vector<Part>& fine, const Body& coarse) {
  double volumes = 0, weights = 0;
  for (std::size_t p = 0; p < fine.size(); ++p) {
    const double cells = fine[p].cell_end - fine[p].cell_begin;
    volumes += cells * std::log(coarse.parts[p].lattice.spacing.prod() / fine[p].lattice.spacing.prod());
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
  CoarseRuns(const LargestDisplacement& most, bool quadratic, const Scene& scene,
             const SimulateOptions& options, const SimulateResult& result, const SolveCoarse& solve,
             Progress& progress)
      : options_(options), solve_(solve), progress_(progress), scene_(scene), quadratic_(quadratic) {
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
  bool add(const Finer& finer, Body& coarse, std::string& reason) {
    try {
      coarse = finer.coarsened();
      if (thin_walls(coarse, 1, quadratic_)) {
        if (found_.size() > 1) throw InputError("walls are thinner than its cells");
        if (finer.has_thin_walls()) throw InputError("walls are thinner than two cells");
      }
      refuse_uneven_cubes(coarse, scene_);  // thin walls come first: they make the displacement a guess
      ratio_.push_back(ratio_of(finer.parts, coarse));
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

// No bar of the largest displacement, or of a probe on the loaded region, is narrower than what the surface gives way there
// unseen by the lattices: they spread the load over a cell each, and may agree on too little.
void hold_indentations(const NarrowRegions& narrow, ErrorBars& errors) {
  for (std::size_t n = 0; n < narrow.loads.size(); ++n) {
    const UnresolvedIndentation& each = narrow.loads[n];
    bool widened = false;
    for (ErrorBar& bar : errors.bars) {
      if (bar.of == ErrorBar::Of::elastic_energy) continue;
      if (bar.of == ErrorBar::Of::probe && narrow.probes[n][bar.probe] == 0) continue;
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

ErrorBars bars_beside(Finest& finest, const Scene& scene, const SimulateOptions& options,
                      const SimulateResult& result, const SolveCoarse& solve, Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  ErrorBars errors;
  errors.cells.push_back(finest.cells);
  const bool quadratic = finest.quadratic;
  CoarseRuns runs(finest.most, quadratic, scene, options, result, solve, progress);
  Body half, quarter;
  std::string reason;
  if (!runs.add(finest.as_finer(), half, reason)) {
    errors.note = "a lattice twice as coarse cannot be solved: " + first_sentence(reason);
    errors.refinement = finest.refinement();
    return errors;
  }
  errors.cells.push_back(half.cell_count());
  bool wide = false;
  double least = kUnevenLeaves;  // of the value, of bars without an order
  if (runs.add(finest.half_as_finer(half), quarter, reason)) {
    errors.cells.push_back(quarter.cell_count());
    if (const std::optional<double> thin = finest.thin(kThinWall)) {
      wide = true;
      errors.note = fmt::format(
          "{:.0f} % of the matter lies in walls under 2 cells: the bars are three times the "
          "largest difference; use a smaller spacing",
          100 * *thin);
    } else if (!finest.narrow.support.empty()) {
      wide = true;
      errors.note =
          finest.narrow.support + ": the bars are three times the largest difference; use a smaller spacing";
    }
  } else {
    wide = true;
    if (!quadratic) least = finest.thin(kFewCells) ? kFewCellsLeave : kOneDifferenceLeaves;
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
  hold_indentations(finest.narrow, errors);
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

}  // namespace

ErrorBars estimate_errors(const Body& body, const Scene& scene, const SimulateOptions& options,
                          const SimulateResult& result, const SolveCoarse& solve, Progress& progress) {
  std::optional<Finest> finest;
  {
    const StopWaits answered;
    finest.emplace(body, scene);
  }
  ErrorBars errors;
  const auto judge = [&] { errors = bars_beside(*finest, scene, options, result, solve, progress); };
  if (other_pieces())
    other_pieces()->let_first(judge);
  else
    judge();
  return errors;
}

}  // namespace flexel::simulate
