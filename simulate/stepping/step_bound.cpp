// Frequencies of cells, connections and effects, put together.
#include "simulate/stepping/step_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "simulate/models/damping_factors.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/stability.h"
#include "simulate/stepping/staged_damping.h"

namespace flexel::simulate {
namespace {

constexpr double kGrowthAhead = 1.25, kLeastAhead = 1.1;

struct Fastest {
  double squared = 0;  // m^2/s^2
  Fastest& operator+=(const Fastest& other) {
    squared = std::max(squared, other.squared);
    return *this;
  }
};

// (elements) The largest factor on the damping of the connections that they have the bits of; empty: 1.
std::vector<double> of_own_connections(const Body& body) {
  const std::span<const double> changes = connection_values(body, "connection_damping_change");
  std::vector<double> largest;
  if (changes.empty()) return largest;
  constexpr std::size_t kWidth = half_neighbourhood.size();
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    double most = 0;
    for (std::size_t bit = 0; bit < kWidth; ++bit)
      if (body.connections[e] >> bit & 1) most = std::max(most, changes[kWidth * e + bit]);
    largest.push_back(1 + most);
  }
  return largest;
}

// Of each part, by what the body's columns make of that of its cells, elements and connections.
std::vector<double> longest_damping(const Body& body, const std::vector<double>& of_parts) {
  std::vector<double> longest = of_parts;
  const std::vector<double> cells = damping_factors(body), elements = element_damping_factors(body),
                            connections = of_own_connections(body);
  for (std::size_t p = 0; p < longest.size(); ++p) {
    const Part& part = body.parts[p];
    const bool by_cells = part.placement == Placement::corner;
    if (!by_cells && !connections.empty() && part.element_begin < part.element_end)
      longest[p] *=
          *std::max_element(connections.begin() + part.element_begin, connections.begin() + part.element_end);
    const std::vector<double>& factor = by_cells ? cells : elements;
    if (factor.empty()) continue;
    const auto from = static_cast<std::ptrdiff_t>(by_cells ? part.cell_begin : part.element_begin);
    const auto to = static_cast<std::ptrdiff_t>(by_cells ? part.cell_end : part.element_end);
    if (from < to) longest[p] *= *std::max_element(factor.begin() + from, factor.begin() + to);
  }
  return longest;
}

}  // namespace

StepBound::StepBound(const Problem& problem, const std::vector<ActiveEffect>& effects,
                     const KernelEffects& plan)
    : problem_(problem),
      effects_(effects),
      plan_(plan),
      cells_(cells_of_parts(problem)),
      stiffening_(cells_.size(), 1),
      connections_(cells_.size(), 0),
      growth_(cells_.size(), 1),
      damping_(longest_damping(problem.body, plan.damping)) {}

bool StepBound::damps_explicitly() const {
  double bare = std::numeric_limits<double>::infinity(), damped = bare;
  for (std::size_t p = 0; p < cells_.size(); ++p) {
    bare = std::min(bare, stable_step(cells_[p].frequency, 0));
    damped = std::min(damped, stable_step(cells_[p].frequency, damping_[p]));
  }
  return damped >= 0.5 * bare;
}

void StepBound::look(const State& state, const PaperModel* paper, const std::vector<double>& mass) {
  stiffening_ = stiffening(problem_, cells_, state.displacement, plan_);
  if (std::any_of(damping_.begin(), damping_.end(), [](double tau) { return tau > 0; }))
    growth_ = damping_growth(problem_, cells_, state.displacement);
  if (paper) connections_ = paper->frequencies(state, mass);
  added_ = 0;
  for (const ActiveEffect& effect : effects_) added_ += effect->added_frequency(state, mass);
}

double StepBound::longest(bool staged_damping) const {
  double longest = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < cells_.size(); ++p) {
    // a part has cells or connections
    const double own = cells_[p].frequency * stiffening_[p] + connections_[p];
    const double total = own + added_;
    if (staged_damping && connections_[p] == 0) {
      longest = std::min(longest, std::sqrt(StagedDamping::kLeast / 4) * stable_step(total, 0));
      continue;
    }
    // what effects add is not damped: total dt^2 / 4 + tau own dt / 2 <= 1
    const double damped = std::max(own, cells_[p].frequency * growth_[p]);
    longest = std::min(longest, stable_step(total, total > 0 ? damping_[p] * (damped / total) : 0));
  }
  return longest;
}

double StepBound::bare_damping_rate() const {
  double largest = 0;
  for (std::size_t p = 0; p < cells_.size(); ++p)
    largest = std::max(largest, damping_[p] * cells_[p].frequency * growth_[p]);
  return largest;
}

double StepBound::damping_rate() const {
  return kGrowthAhead * bare_damping_rate();
}

double StepBound::travel(const State& state, double step) const {
  const double fastest = std::sqrt(parallel_sum<Fastest>(state.velocity.size(), [&](std::size_t e) {
                                     return Fastest{state.velocity[e].squaredNorm()};
                                   }).squared);
  double narrowest = std::numeric_limits<double>::infinity();
  for (const Part& part : problem_.body.parts)
    narrowest = std::min(narrowest, part.lattice.spacing.minCoeff());
  return step * fastest / narrowest;
}

bool StepBound::outgrows(double rate, const State& state, double step, std::uint64_t steps) {
  constexpr double kTravel = 0.05, kMostSteps = 16;
  const double allowed = kTravel / travel(state, step);
  const auto every = static_cast<std::uint64_t>(std::clamp(allowed, 1.0, kMostSteps));
  if (steps % every != 0) return false;
  growth_ = damping_growth(problem_, cells_, state.displacement);
  return kLeastAhead * bare_damping_rate() > rate;
}

}  // namespace flexel::simulate
