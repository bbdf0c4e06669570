// Sums over the body at samples; powers at every step.
#include "simulate/time/history.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "formats/parallel.h"

namespace flexel {
namespace {

struct Momenta {
  double kinetic = 0;
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  Momenta& operator+=(const Momenta& other) {
    kinetic += other.kinetic;
    linear += other.linear;
    angular += other.angular;
    return *this;
  }
};

}  // namespace

History::History(const Setting& setting, const std::vector<Pass>& passes,
                 const std::vector<ProbePoints>& probes, const std::vector<double>& mass,
                 const PaperModel* paper, const StepPlan& plan)
    : setting_(setting),
      passes_(passes),
      probes_(probes),
      mass_(mass),
      paper_(paper),
      cells_(setting, no_stencil_),
      forces_(passes.size()),
      energy_(passes.size() + 2, 0) {
  for (std::size_t p = 0; p < passes.size(); ++p)
    if (passes[p].add_forces && passes[p].book != Book::potential)
      forces_[p].assign(setting.body.element_count(), Vec3::Zero());
  csv_ = "time [s],kinetic [J],elastic [J],potential [J],work [J],dissipated [J],residual [J]";
  for (const Pass& pass : passes)
    if (pass.add_forces && pass.book != Book::potential)
      fmt::format_to(std::back_inserter(csv_), ",{} {} [J]", pass.name,
                     pass.book == Book::work ? "work" : "dissipated");
  csv_ += ",supports work [J],damping dissipated [J]";
  const auto add = [&](const char* name) {
    energy_.push_back(0);
    fmt::format_to(std::back_inserter(csv_), ",{} dissipated [J]", name);
    return energy_.size() - 1;
  };
  if (!plan.plasticity.empty()) plasticity_ = add("plasticity");
  if (!plan.fracture.empty()) fracture_ = add("fracture");
  for (const char* name : {"momentum", "angular momentum"})
    for (const char axis : {'x', 'y', 'z'})
      fmt::format_to(std::back_inserter(csv_), ",{} {} [{}]", name, axis,
                     std::string(name) == "momentum" ? "kg m/s" : "kg m2/s");
  for (const ProbePoints& probe : probes)
    for (const char axis : {'x', 'y', 'z'})
      fmt::format_to(std::back_inserter(csv_), ",{} {} [m]", probe.name, axis);
  csv_ += '\n';
}

void History::before(const State& state, bool sample) {
  velocity_ = state.velocity;
  sample_ = sample;
  time_ = *state.time;
  if (!sample) return;
  sampled_.displacement = state.displacement;
  // with plasticity or fracture the step tells that of the cells
  elastic_ = (plasticity_ || fracture_ ? 0 : cells_.energy(state)) + (paper_ ? paper_->energy(state) : 0);
  potential_ = 0;
  for (const Pass& pass : passes_)
    if (pass.book == Book::potential && pass.energy) potential_ += pass.energy(state);
}

void History::after(const State& state, const StepOutcome& outcome, const std::vector<Vec3>& damping,
                    const std::vector<Vec3>& supports, double previous_step, double step) {
  const auto add_powers = [&](const std::vector<Vec3>& velocity, double time) {
    const auto energy = [&](const std::vector<Vec3>& forces) {
      return time *
             parallel_sum<double>(forces.size(), [&](std::size_t e) { return forces[e].dot(velocity[e]); });
    };
    for (std::size_t p = 0; p < passes_.size(); ++p) energy_[p] += energy(forces_[p]);
    energy_[passes_.size()] += energy(supports);
    energy_[passes_.size() + 1] += energy(damping) + energy(connection_damping_);
  };
  add_powers(velocity_, 0.5 * previous_step);
  if (plasticity_) energy_[plasticity_] -= outcome.plastic_work;
  if (fracture_) energy_[fracture_] -= outcome.released;
  if (outcome.elastic) elastic_ += *outcome.elastic;
  if (sample_) add_row(state);
  add_powers(state.velocity, 0.5 * step);
}

void History::add_row(const State& state) {
  const Momenta sum = parallel_sum<Momenta>(mass_.size(), [&](std::size_t e) {
    const Vec3 mean = 0.5 * (velocity_[e] + state.velocity[e]);
    const Vec3 at = setting_.body.rest[e] + sampled_.displacement[e];
    return Momenta{0.5 * mass_[e] * velocity_[e].dot(state.velocity[e]), mass_[e] * mean,
                   mass_[e] * at.cross(mean)};
  });
  Energies now{sum.kinetic, elastic_, potential_, 0, 0, 0};
  for (std::size_t p = 0; p < energy_.size(); ++p) {
    const bool dissipates =
        p > passes_.size() || (p < passes_.size() && passes_[p].book == Book::dissipation);
    (dissipates ? now.dissipated : now.work) += dissipates ? -energy_[p] : energy_[p];
  }
  const double book = now.kinetic + now.elastic + now.potential + now.dissipated - now.work;
  if (first_) start_ = book;
  first_ = false;
  now.residual = book - start_;
  last_ = now;
  worst_residual_ = std::max(worst_residual_, std::abs(now.residual));
  for (const double term : {now.kinetic, now.elastic, now.potential, now.work, now.dissipated})
    largest_term_ = std::max(largest_term_, std::abs(term));
  auto out = std::back_inserter(csv_);
  fmt::format_to(out, "{:.17g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.3g}", time_, now.kinetic, now.elastic,
                 now.potential, now.work, now.dissipated, now.residual);
  for (std::size_t p = 0; p < energy_.size(); ++p) {
    if (p < passes_.size() && forces_[p].empty()) continue;
    const bool dissipates =
        p > passes_.size() || (p < passes_.size() && passes_[p].book == Book::dissipation);
    fmt::format_to(out, ",{:.9g}", dissipates ? 0.0 - energy_[p] : energy_[p]);
  }
  for (const Vec3& vector : {sum.linear, sum.angular})
    for (const double value : vector) fmt::format_to(out, ",{:.12g}", value);
  for (const ProbePoints& probe : probes_)
    for (const double value : measure(probe, sampled_).displacement) fmt::format_to(out, ",{:.12g}", value);
  csv_ += '\n';
}

}  // namespace flexel
