// For a given power the fit is linear in c and a; powers are tried one by one.
#include "flexel/study/predict.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexel::study {
namespace {

constexpr double kPriorWeight = 0.01;  // of a prior, beside 1 of the largest run
constexpr double kPowerSpread = 0.2;   // by which powers usually differ from the prior's
constexpr double kLeastSeconds = 1e-3, kLeastBytes = 1e6;

// Measured on one machine (AMD EPYC, two threads) on the bracket of samples/bracket, a STEP file of 21,000
// triangles: seconds by stage, cells or cells times steps.
PowerLaw prior_of(const std::string& stage, bool timed) {
  if (stage == "start") return {0.15, 0, 1};
  if (stage == "read") return {0.08, 1e-6, 1};
  if (stage == "heal") return {0.01, 0, 1};
  if (stage == "voxelize") return {0.05, 1.5e-6, 1};
  if (stage == "assemble") return timed ? PowerLaw{0.01, 5e-8, 1} : PowerLaw{0.002, 1.5e-5, 1};
  if (stage == "solve") return timed ? PowerLaw{0.01, 2e-8, 1} : PowerLaw{0.005, 5e-5, 1.02};
  if (stage == "error bars") return {1e-3, 0, 1};
  if (stage == "map") return {0.03, 2e-6, 1};
  return {0.01, 2e-6, 1};  // write
}

// Of the L-bracket of docs/measurements/accuracy.md, 1,664 to 12,428 tetrahedra.
PowerLaw calculix_prior(const std::string& stage) {
  if (stage == "voxelize") return {0.6, 6e-5, 1};
  if (stage == "solve") return {0.1, 5.5e-6, 1.45};
  return {0, 0, 1};
}

// As above, without what processes start, read and write.
PowerLaw one_process_prior(const std::string& stage) {
  if (stage == "voxelize") return {0.02, 1.5e-6, 1};
  if (stage == "solve") return {0.005, 6.5e-5, 1.02};
  if (stage == "error bars") return {0.002, 1.5e-5, 1};
  if (stage == "map") return {0.03, 2e-6, 1};
  return {0, 0, 1};
}

constexpr std::array<PowerLaw, 3> kPriorMemory = {PowerLaw{75e6, 150, 1}, PowerLaw{30e6, 4400, 1},
                                                  PowerLaw{17e6, 420, 1}};
constexpr std::array<PowerLaw, 3> kCalculixMemory = {PowerLaw{75e6, 1500, 1}, PowerLaw{20e6, 930, 1.33},
                                                     PowerLaw{0, 0, 1}};
constexpr std::array<PowerLaw, 3> kOneProcessMemory = {PowerLaw{90e6, 4400, 1}, PowerLaw{0, 0, 1},
                                                       PowerLaw{0, 0, 1}};

bool steps_in_time(const std::string& stage) {
  return stage == "assemble" || stage == "solve";
}

struct Candidate {
  PowerLaw law;
  double cost = std::numeric_limits<double>::infinity();
};

// The normal equations in c / Y and a X^p / Y, with X the largest run and Y what it took.
Candidate fit_power(const std::vector<Observation>& seen, const PowerLaw& prior, double power) {
  const Observation& largest =
      *std::max_element(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
  // Of the prior only the shares of its two parts count: machines differ in speed.
  const double share = prior.slope * std::pow(largest.x, prior.power) / prior.at(largest.x);
  const double prior_c = 1 - share, prior_a = share;
  double cc = kPriorWeight, ca = 0, aa = kPriorWeight;
  double cy = kPriorWeight * prior_c, ay = kPriorWeight * prior_a;
  for (const Observation& each : seen) {
    const double weight = std::sqrt(each.x / largest.x);
    const double c = largest.y / each.y, a = c * std::pow(each.x / largest.x, power);
    cc += weight * c * c;
    ca += weight * c * a;
    aa += weight * a * a;
    cy += weight * c;
    ay += weight * a;
  }
  const double determinant = cc * aa - ca * ca;
  double c = (cy * aa - ay * ca) / determinant, a = (ay * cc - cy * ca) / determinant;
  if (!(c >= 0)) {
    c = 0;
    a = ay / aa;
  } else if (!(a >= 0)) {
    a = 0;
    c = cy / cc;
  }
  Candidate found;
  found.law = {c * largest.y, a * largest.y / std::pow(largest.x, power), power};
  const double away = (power - prior.power) / kPowerSpread;
  found.cost = kPriorWeight * ((c - prior_c) * (c - prior_c) + (a - prior_a) * (a - prior_a) + away * away);
  for (const Observation& each : seen) {
    const double miss = found.law.at(each.x) / each.y - 1;
    found.cost += std::sqrt(each.x / largest.x) * miss * miss;
  }
  return found;
}

}  // namespace

double PowerLaw::at(double x) const {
  return constant + slope * std::pow(x, power);
}

PowerLaw fit(const std::vector<Observation>& observations, const PowerLaw& prior, bool powers_vary) {
  if (observations.empty()) return prior;
  Candidate best;
  for (int i = -4; i <= 6; ++i) {
    if (i != 0 && !powers_vary) continue;
    const Candidate found = fit_power(observations, prior, prior.power + 0.05 * i);
    if (found.cost < best.cost) best = found;
  }
  return best.law;
}

void Predictor::add(const std::string& kind, const RunSize& size, const RunResult& run) {
  Kind& entry = kinds_[kind];
  for (const Stage& stage : run.stages) {
    const double x = steps_in_time(stage.name) ? size.cells * size.steps : size.cells;
    entry.stages[stage.name].push_back({x, std::max(stage.wall, kLeastSeconds)});
  }
  for (std::size_t p = 0; p < entry.memory.size(); ++p)
    entry.memory[p].push_back({size.cells, std::max(run.program_memory[p], kLeastBytes)});
}

PowerLaw Predictor::stage_law(const std::string& kind, const std::string& stage, bool timed) const {
  // An implicit step solves what a run at equilibrium does; nothing follows for it from explicit ones.
  const bool solves = kind == "implicit";
  const PowerLaw prior = kind == kCalculix     ? calculix_prior(stage)
                         : kind == kOneProcess ? one_process_prior(stage)
                         : kind.empty() || (solves && steps_in_time(stage))
                             ? prior_of(stage, timed && !solves)
                             : stage_law("", stage, timed);
  const auto found = kinds_.find(kind);
  if (found == kinds_.end() || found->second.stages.count(stage) == 0) return prior;
  return fit(found->second.stages.at(stage), prior, steps_in_time(stage) && !timed);
}

PowerLaw Predictor::memory_law(const std::string& kind, std::size_t program) const {
  const PowerLaw prior = kind == kCalculix     ? kCalculixMemory[program]
                         : kind == kOneProcess ? kOneProcessMemory[program]
                         : kind.empty()        ? kPriorMemory[program]
                                               : memory_law("", program);
  const auto found = kinds_.find(kind);
  if (found == kinds_.end() || !(prior.at(1) > 0)) return prior;
  return fit(found->second.memory[program], prior, kind == kCalculix);
}

Prediction Predictor::predict(const std::string& kind, const RunSize& size) const {
  Prediction result;
  const bool timed = size.steps > 1;
  for (const char* stage : kStages) {
    const double x = steps_in_time(stage) ? size.cells * size.steps : size.cells;
    result.stages.push_back({stage, stage_law(kind, stage, timed).at(x)});
    result.seconds += result.stages.back().wall;
  }
  for (std::size_t p = 0; p < kPriorMemory.size(); ++p)
    result.bytes = std::max(result.bytes, memory_law(kind, p).at(size.cells));
  return result;
}

}  // namespace flexel::study
