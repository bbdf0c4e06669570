// The order follows from predictions alone; nothing here looks at the clock.
#include "flexel/study/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/units.h"
#include "flexel/study/accuracy_analysis.h"
#include "mapping/methods/method.h"

namespace flexel::study {
namespace {

constexpr int kCellsThrough[] = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128};
constexpr double kMiddleShare = 1.0 / 60;  // of the budget, what one run of the middle may take
constexpr double kMiddleMost = 1.0 / 20;   // the same where no size takes less
constexpr double kTolerances[] = {1e-2, 1e-4, 1e-6};
constexpr const char* kIntegrators[] = {"symplectic", "verlet", "explicit", "implicit"};

std::string human_size(double size) {
  return human_length(size);
}

}  // namespace

double rounded(double size) {
  const double unit = std::pow(10.0, std::floor(std::log10(size)) - 2);
  return std::round(size / unit) * unit;
}

std::string Trial::kind() const {
  const Configuration& c = configuration;
  std::string kind;
  if (sweep == "calculix") kind = kCalculix;
  if (sweep == "model") kind = c.model + c.hooke;
  if (sweep == "integrator") kind = c.integrator;
  if (sweep == "threads") kind = fmt::format("{} threads", c.threads);
  if (sweep == "effect") kind = label;
  if (sweep == "mapping") kind = c.method;
  return kind;
}

std::vector<double> ladder_of_sizes(double wall, double spacing, double cells_there, double fewest,
                                    int rungs) {
  const double coarsest = spacing * std::cbrt(cells_there / fewest);
  std::vector<double> sizes;
  for (const int cells : kCellsThrough)
    if (const double size = rounded(wall / cells);
        size <= 1.001 * coarsest && static_cast<int>(sizes.size()) < rungs)
      sizes.push_back(size);
  // Walls that no lattice resolves say nothing about the sizes that are of use.
  if (sizes.size() < 4 || sizes.front() < coarsest / 3) {
    sizes.clear();
    for (double size = coarsest; static_cast<int>(sizes.size()) < rungs; size /= std::cbrt(2.5))
      sizes.push_back(rounded(size));
  }
  return sizes;
}

Sweep::Sweep(SceneFacts facts, Configuration first, const std::vector<double>& sizes, double budget,
             int cores)
    : facts_(std::move(facts)), first_(std::move(first)), budget_(budget), cores_(cores) {
  for (const double size : sizes) rungs_.emplace_back().size = size;
}

Trial Sweep::trial(const std::string& sweep, const std::string& choice, double size,
                   const Configuration& configuration) const {
  Trial result{sweep, choice.empty() ? human_size(size) : choice + " " + human_size(size), configuration};
  result.configuration.size = size;
  return result;
}

std::vector<Trial> Sweep::open() const {
  std::vector<Trial> all, result;
  if (climbing())
    for (const Rung& rung : rungs_)
      if (!rung.done) {
        all.push_back(trial("resolution", "", rung.size, first_));
        break;
      }
  if (const std::optional<Trial> next = next_against()) all.push_back(*next);
  const auto take_open = [&] {
    for (const Trial& each : all)
      if (closed_.count(each.label) == 0) result.push_back(each);
  };
  if (const std::optional<std::size_t> rung = middle()) {
    add_models(all, *rung);
    if (facts_.timed) add_timed(all, rungs_[*rung]);
    add_effects(all, rungs_[*rung]);
    take_open();
    if (result.empty()) add_switches(all, *rung);
  }
  if (result.empty()) take_open();
  return result;
}

void Sweep::set_against(std::vector<double> edges, double volume) {
  edges_ = std::move(edges);
  volume_ = volume;
}

std::optional<Trial> Sweep::next_against() const {
  Configuration bare;
  bare.method = "";  // nothing is mapped
  for (const double edge : edges_) {
    const Trial next = trial("calculix", "CalculiX", edge, bare);
    if (closed_.count(next.label) == 0 && !against_ended_) return next;
  }
  return std::nullopt;
}

void Sweep::add_models(std::vector<Trial>& trials, std::size_t r) const {
  const std::string own = first_.model.empty() ? "cells" : first_.model;
  for (const auto& [model, hooke] : {std::pair<const char*, const char*>{"cells", ""},
                                     {"springs", ""},
                                     {"paper", "paper"},
                                     {"paper", "ganovelli"}}) {
    if (model == own && (*hooke == 0 || first_.hooke == hooke)) continue;
    Configuration each = first_;
    each.model = model;
    each.hooke = hooke;
    trials.push_back(
        trial("model", *hooke != 0 && each.hooke != "paper" ? each.hooke : model, rungs_[r].size, each));
  }
}

bool Sweep::climbing() const {
  return !ladder_ended_ &&
         std::any_of(rungs_.begin(), rungs_.end(), [](const Rung& rung) { return !rung.done; });
}

// The finest size of use at which a run takes a small share of the budget; where none does, the coarsest of
// use if that is not out of proportion.
std::optional<std::size_t> Sweep::middle() const {
  std::optional<std::size_t> best;
  if (climbing()) return best;
  for (std::size_t r = 0; r < rungs_.size(); ++r) {
    const Rung& rung = rungs_[r];
    if (!rung.found || rung.found->cells < static_cast<double>(kFewestOfUse) ||
        rung.thin_matter > kThinMatter)
      continue;
    if (rung.wall <= (best ? kMiddleShare : kMiddleMost) * budget_) best = r;
  }
  return best;
}

// What changes the time or the last digits only.
void Sweep::add_switches(std::vector<Trial>& trials, std::size_t r) const {
  const Rung& rung = rungs_[r];
  const std::span<const mapping::MapMethod> methods = mapping::map_methods();
  for (auto row = methods.rbegin(); row != methods.rend(); ++row) {  // the default last
    const std::string method = name_of(*row);
    if (method == first_.method || *row == &mapping::kShapeFunctions) continue;
    Configuration each = first_;
    each.method = method;
    trials.push_back(trial("mapping", method, rung.size, each));
  }
  for (int threads = 1; threads <= cores_; threads *= 2) {
    Configuration each = first_;
    each.threads = threads;
    trials.push_back(
        trial("threads", threads == 1 ? "1 thread" : fmt::format("{} threads", threads), rung.size, each));
  }
  if (facts_.timed) return;
  for (const double tolerance : kTolerances) {
    if (tolerance == facts_.tolerance) continue;
    Configuration each = first_;
    each.tolerance = tolerance;
    trials.push_back(trial("tolerance", fmt::format("tolerance {:.0e}", tolerance), rung.size, each));
  }
}

void Sweep::add_timed(std::vector<Trial>& trials, const Rung& rung) const {
  for (const char* integrator : kIntegrators) {
    if (integrator == facts_.integrator) continue;
    Configuration each = first_;
    each.integrator = integrator;
    trials.push_back(trial("integrator", integrator, rung.size, each));
  }
  for (const double share : {0.5, 0.25}) {
    if (!(rung.step > 0)) continue;
    Configuration each = first_;
    each.step = share * rung.step;
    trials.push_back(trial("step", fmt::format("step x {:g}", share), rung.size, each));
  }
}

// Where one thing alone acts, leaving it out leaves nothing to run at equilibrium.
void Sweep::add_effects(std::vector<Trial>& trials, const Rung& rung) const {
  const auto acts = [](const SceneEffect& effect) {
    return effect.key == "load" || effect.key == "move" || effect.key == "gravity";
  };
  const auto acting = std::count_if(facts_.effects.begin(), facts_.effects.end(), acts);
  for (const SceneEffect& effect : facts_.effects) {
    if (!facts_.timed && acts(effect) && acting < 2) continue;
    Configuration each = first_;
    each.without = effect.name;
    trials.push_back(trial("effect", "without " + effect.name, rung.size, each));
  }
  Configuration bare = first_;
  bare.stress = false;
  trials.push_back(trial("effect", "without stress", rung.size, bare));
  if (facts_.timed) return;
  Configuration bars = first_;
  bars.error_bars = true;
  trials.push_back(trial("effect", "with error bars", rung.size, bars));
}

RunSize Sweep::size_of(const Trial& wanted) const {
  if (wanted.sweep == "calculix") {
    const double edge = wanted.configuration.size;
    const auto [known, cells] =
        edge_and_cells_.value_or(std::pair(edge, kTetrahedraInCube * volume_ / std::pow(edge, 3)));
    return {cells * std::pow(known / edge, 3), 1};
  }
  // From the nearest size that is known; cells go with the third power of the size, explicit steps with it.
  const Rung* nearest = nullptr;
  const auto away = [&](const Rung& rung) {
    return std::abs(std::log(rung.size / wanted.configuration.size));
  };
  for (const Rung& rung : rungs_)
    if (rung.found && (nearest == nullptr || away(rung) < away(*nearest))) nearest = &rung;
  if (nearest == nullptr) return {100, facts_.timed ? 1000.0 : 1.0};
  const double finer = nearest->size / wanted.configuration.size;
  RunSize size{nearest->found->cells * finer * finer * finer, nearest->found->steps};
  if (!facts_.timed) return size;
  const std::string integrator =
      wanted.configuration.integrator.empty() ? facts_.integrator : wanted.configuration.integrator;
  if (integrator == "implicit" && facts_.integrator != "implicit")
    size.steps = 200;
  else if (wanted.configuration.step)
    size.steps = facts_.duration / *wanted.configuration.step;
  else if (integrator != "implicit" && !facts_.own_step)
    size.steps *= finer;
  return size;
}

Prediction Sweep::predict(const Trial& wanted, std::optional<std::size_t> counted) const {
  RunSize size = size_of(wanted);
  if (counted) size.cells = static_cast<double>(*counted);
  Prediction prediction = predictor_.predict(wanted.kind(), size);
  if (wanted.sweep == "threads" && !predictor_.knows(wanted.kind()))
    prediction.seconds *= thread_factor(wanted);
  return prediction;
}

// Amdahl, 1967: of the work of a run on all n cores, s + p, s is done by one thread and takes s + p / n.
double Sweep::thread_factor(const Trial& wanted) const {
  for (const Rung& rung : rungs_) {
    if (!rung.found || rung.size != wanted.configuration.size || cores_ < 2) continue;
    const double shared = std::clamp((rung.cpu - rung.wall) * cores_ / (cores_ - 1), 0.0, rung.cpu);
    return (rung.cpu - shared + shared / wanted.configuration.threads) / rung.wall;
  }
  return 1;
}

void Sweep::done(const Trial& ended, const RunResult& found) {
  closed_.insert(ended.label);
  if (ended.sweep == "calculix") {
    if (found.ok()) {
      edge_and_cells_ = {ended.configuration.size, static_cast<double>(found.cells)};
      predictor_.add(kCalculix, {static_cast<double>(found.cells), 1}, found);
    }
    against_ended_ = against_ended_ || found.out_of_time;
    return;
  }
  for (Rung& rung : rungs_)
    if (ended.sweep == "resolution" && rung.size == ended.configuration.size) {
      rung.done = true;
      if (!found.ok()) {
        ladder_ended_ = ladder_ended_ || found.out_of_time;
        break;
      }
      rung.found =
          RunSize{static_cast<double>(found.size()), facts_.timed ? static_cast<double>(found.steps) : 1.0};
      rung.spacing = found.spacing;
      rung.step = found.step;
      rung.wall = found.wall;
      rung.cpu = found.cpu;
      rung.thin_matter = found.thin_matter;
    }
  if (found.ok())
    predictor_.add(ended.kind(),
                   {static_cast<double>(found.size()), facts_.timed ? static_cast<double>(found.steps) : 1.0},
                   found);
}

void Sweep::leave_out(const Trial& trial) {
  closed_.insert(trial.label);
  if (trial.sweep == "resolution") ladder_ended_ = true;
  if (trial.sweep == "calculix") against_ended_ = true;
}

}  // namespace flexel::study
