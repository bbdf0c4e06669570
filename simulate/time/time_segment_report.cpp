// What an act tells when it is over: forces, what can be measured on its last state, and where the time went.
#include <fmt/format.h>

#include <algorithm>

#include "simulate/matter/masses.h"
#include "simulate/probes/report.h"
#include "simulate/time/time_segment.h"

namespace flexel::simulate {

void TimeSegment::tell_forces(SimulateResult& result, const State& state) const {
  std::vector<Vec3> unbalanced(body_.element_count(), Vec3::Zero());
  held_->add_forces(unbalanced);
  for (Vec3& force : unbalanced) force = -force;
  for (const ActiveEffect& effect : effects_) effect->report(state, unbalanced, result);
}

void TimeSegment::report(const Clock& clock, bool stress, SimulateResult& result) {
  for (const ProbePoints& probe : probes_)
    if (!probe.is_to_come()) result.probes.push_back(measure(probe, state_));
  const Stencil none;
  const Cells cells(problem_, none);
  const std::optional<double> inelastic = stepper_->elastic_energy(state_);
  result.elastic_energy =
      (inelastic ? *inelastic + (guard_ ? guard_->energy(state_) : 0) : cells.energy(state_)) +
      (paper_ ? paper_->energy(state_) : 0);
  if (body_.cell_count() > 0) result.smallest_jacobian = cells.smallest_jacobian(state_).value;
  if (paper_)
    result.smallest_jacobian = std::min(result.smallest_jacobian, paper_->smallest_volume(state_).value);
  measure_corners(cells.smallest_corner_jacobian(state_), body_, result, progress_);
  if (stress) measure_stress(problem_, state_, body_, result);
  measure_displacement(body_, state_, result);
  for (const double mass : lumped_masses(problem_)) result.mass += mass;
  result.timed = TimedSummary{*state_.time, clock.steps, clock.step, stepper_->isa(), {}};
  for (const std::string& warning : warnings_of(result)) progress_.warn(scene_.name + ": " + warning);
}

// Of the time of the hot loop, to each effect in it the share that it has of a step from the present state.
void TimeSegment::tell_loop_apart() {
  if (euler_ || !(kernel_seconds_ > 0)) return;
  KernelShares shares = stepper_->time_shares(state_);
  const double loop = kernel_seconds_;
  if (staged_) {  // what is beyond the first stage is for damping
    const double first = 1 / static_cast<double>(std::max<std::size_t>(staged_->stages(), 1));
    shares = {1 - first * (1 - shares.damping), first * shares.plasticity, first * shares.fracture};
  }
  for (const ActiveEffect& effect : effects_) {
    const double seconds = loop * effect->kernel_share(shares);
    effect.seconds += seconds;
    kernel_seconds_ -= seconds;
  }
}

void TimeSegment::add_effort(SimulateResult& result, bool explained) {
  if (explained) tell_loop_apart();
  result.newton_iterations += newton_iterations_;
  result.cg_iterations += cg_iterations_;
  if (euler_) kernel_seconds_ -= euler_->add_seconds(effects_);
  std::vector<EffectShare> shares{{"cells",
                                   euler_ ? "model of every part, Newton's method and its linear solver"
                                          : fmt::format("model of every part, kernel {}", stepper_->isa()),
                                   kernel_seconds_ + check_seconds_}};
  if (paper_) shares.push_back({"connections", "model of centre-placed parts", paper_seconds_});
  for (const ActiveEffect& effect : effects_) shares.push_back({effect.name, effect.why, effect.seconds});
  add_shares(shares, result.shares);
}

}  // namespace flexel::simulate
