// Both ends of a connection remember it and decide alike: lengths and stretches have the same bits at both.
#include "simulate/paper/connection_yield.h"

#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kYieldGrain = 512;
const double kRoot = std::sqrt(2.0 / 3.0);

Mat3 deviator(const Mat3& tensor) {
  return tensor - tensor.trace() / 3 * Mat3::Identity();
}

// Rate of the length [m/s].
double rate(const State& state, const Stretch& now, std::uint32_t from, std::uint32_t to) {
  return now.direction.dot(state.velocity[to] - state.velocity[from]);
}

struct YieldStress {
  double stress, slope;  // Pa
};

// At the equivalent plastic strain; `factor` is on the yield stress alone.
YieldStress yield_stress(const PlasticFlow& flow, double factor, double strain) {
  YieldStress now{flow.yield * factor + flow.hardening * strain, flow.hardening};
  if (!(flow.saturation > 0)) return now;
  const double left = std::exp(-flow.rate * strain);
  now.stress += flow.saturation * (1 - left);
  now.slope += flow.saturation * flow.rate * left;
  return now;
}

}  // namespace

ConnectionLosses& ConnectionLosses::operator+=(const ConnectionLosses& other) {
  broken += other.broken;
  released += other.released;
  plastic_work += other.plastic_work;
  return *this;
}

ConnectionYield::ConnectionYield(const Problem& problem, const KernelEffects& plan, PaperModel& model)
    : body_(problem.body),
      model_(model),
      flow_(problem.body.parts.size()),
      elongation_(problem.body.parts.size(), std::numeric_limits<double>::infinity()),
      strength_(connection_factors(problem.body, model.rows(), "strength")),
      yield_(element_factors(problem.body, "yield_change")) {
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    if (body_.parts[p].placement != Placement::centre) continue;
    if (!plan.plasticity.empty()) flow_[p] = plan.plasticity[p];
    if (!plan.fracture.empty()) elongation_[p] = plan.fracture[p].elongation;
    flows_ = flows_ || std::isfinite(flow_[p].yield);
    breaks_ = breaks_ || std::isfinite(elongation_[p]);
  }
  ConnectionMemory& memory = model.memory();
  const std::size_t entries = model.rows().entries.size();
  if (flows_) {
    memory.flowed.resize(entries, 0);
    memory.strain = element_values(body_, "plastic_strain");
    memory.strain.resize(body_.element_count(), 0);
    flows_now_.resize(body_.element_count());
  }
  if (breaks_) memory.broken.resize(entries, 0);
}

ConnectionLosses ConnectionYield::advance(const State& state) {
  ConnectionLosses losses;
  if (breaks_) losses += tear(state);
  if (flows_) losses += flow(state);
  return losses;
}

double ConnectionYield::longest(std::uint32_t element, const ConnectionRows::Entry& entry) const {
  return model_.kind(element, entry.kind).length *
         (1 +
          elongation_[model_.part_of(element)] * (strength_.empty() ? 1 : strength_[model_.place(entry)]));
}

// The energy is that of half a step before: what the leapfrog loses when a force is taken away.
ConnectionLosses ConnectionYield::tear(const State& state) {
  ConnectionMemory& memory = model_.memory();
  return parallel_sum<ConnectionLosses>(
      body_.element_count(),
      [&](std::size_t e) {
        ConnectionLosses own;
        const auto element = static_cast<std::uint32_t>(e);
        for (const ConnectionRows::Entry& entry : model_.rows().of(element)) {
          const std::size_t place = model_.place(entry);
          if (memory.broken[place]) continue;
          const Stretch now = model_.stretched(state, element, entry);
          if (!(now.length > longest(element, entry))) continue;
          const double force = model_.stiffness(element, entry) * now.elongation;
          memory.broken[place] = 1;
          if (entry.sign < 0) continue;
          ++own.broken;
          own.released +=
              0.5 * force * (now.elongation - state.kick * rate(state, now, element, entry.other));
        }
        return own;
      },
      kYieldGrain);
}

Mat3 ConnectionYield::flow_of(const State& state, std::uint32_t element, double& strain) const {
  const std::uint32_t part = model_.part_of(element);
  const auto row = model_.rows().of(element);
  if (row.empty() || !std::isfinite(flow_[part].yield)) return Mat3::Zero();
  const double volume = body_.parts[part].lattice.spacing.prod();
  Mat3 stress = Mat3::Zero();
  for (const ConnectionRows::Entry& entry : row) {
    const double stiffness = model_.stiffness(element, entry);
    if (stiffness == 0) continue;
    const Stretch now = model_.stretched(state, element, entry);
    stress += (stiffness * now.elongation * now.length) * now.direction * now.direction.transpose();
  }
  const Mat3 s = deviator(stress / (2 * volume));
  const double size = s.norm();
  const YieldStress yield = yield_stress(flow_[part], yield_.empty() ? 1 : yield_[element], strain);
  const double bound = kRoot * yield.stress;
  if (!(size > bound)) return Mat3::Zero();
  const Mat3 normal = s / size;
  double softening = 0;
  for (const ConnectionRows::Entry& entry : row) {
    const double stiffness = model_.stiffness(element, entry);
    if (stiffness == 0) continue;
    const Stretch now = model_.stretched(state, element, entry);
    const double along = now.direction.dot(normal * now.direction);
    softening += stiffness * now.length * model_.kind(element, entry.kind).length * along * along;
  }
  const double flowed = (size - bound) / (softening / (2 * volume) + 2 * yield.slope / 3);
  strain += kRoot * flowed;
  return flowed * normal;
}

// A connection's work: its mean force over the step, in which its stretch grew by that of its length, less what it
// flowed.
ConnectionLosses ConnectionYield::flow(const State& state) {
  ConnectionMemory& memory = model_.memory();
  parallel_for_each(
      body_.element_count(),
      [&](std::size_t e) { flows_now_[e] = flow_of(state, static_cast<std::uint32_t>(e), memory.strain[e]); },
      kYieldGrain);
  return parallel_sum<ConnectionLosses>(
      body_.element_count(),
      [&](std::size_t e) {
        ConnectionLosses own;
        const auto element = static_cast<std::uint32_t>(e);
        for (const ConnectionRows::Entry& entry : model_.rows().of(element)) {
          const Mat3 both = flows_now_[e] + flows_now_[entry.other];
          const double stiffness = model_.stiffness(element, entry);
          if (stiffness == 0 || both.isZero(0)) continue;
          const Stretch now = model_.stretched(state, element, entry);
          const double moved =
              0.5 * model_.kind(element, entry.kind).length * now.direction.dot(both * now.direction);
          memory.flowed[model_.place(entry)] += moved;
          if (entry.sign > 0)
            own.plastic_work +=
                stiffness * moved *
                (now.elongation - 0.5 * moved - 0.5 * state.kick * rate(state, now, element, entry.other));
        }
        return own;
      },
      kYieldGrain);
}

void ConnectionYield::write(Body& body) const {
  if (!acts()) return;
  const ConnectionMemory& memory = model_.memory();
  const std::size_t width = half_neighbourhood.size();
  Column rest{static_cast<int>(width), {}};
  if (flows_) {
    rest.values.assign(width * body.element_count(), 0);
    body.element_columns["plastic_strain"] = {1, memory.strain};
  }
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    for (const ConnectionRows::Entry& entry : model_.rows().of(e)) {
      if (entry.sign < 0) continue;
      const std::size_t place = model_.place(entry), bit = entry.kind - std::size_t{1};
      if (breaks_ && memory.broken[place]) body.connections[e] &= ~(1u << bit);
      if (flows_) rest.values[width * e + bit] = memory.flowed[place];
    }
  if (flows_) body.element_columns["connection_rest"] = std::move(rest);
}

}  // namespace flexel::simulate
