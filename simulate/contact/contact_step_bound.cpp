// Rows of elements, and of free rigid parts as a whole.
#include "simulate/contact/contact_step_bound.h"

#include <algorithm>
#include <cmath>

namespace flexel::simulate {
namespace {

constexpr double kHardeningAhead = 1.3;              // growth of hardening until the next check
constexpr double kRigidSafety = 4;                   // of rigid parts, whose whole impact is one oscillation
constexpr double kTravel = 0.12, kMostTravel = 0.2;  // spacings a step: asked for, and allowed

// omega^2 that bounds the step like a dashpot of tau beside a stiffness of omega^2 (time/stability.h).
double damped(double omega2, double tau) {
  const double zeta = 0.5 * tau * std::sqrt(omega2);
  const double factor = std::sqrt(1 + zeta * zeta) + zeta;
  return omega2 * factor * factor;
}

}  // namespace

ContactStepBound::ContactStepBound(const ContactSettings& settings, const ContactSurface& surface,
                                   const PairList& list, const PairStates& states)
    : settings_(settings), surface_(surface), list_(list), states_(states) {}

void ContactStepBound::add_row(std::uint32_t number, const Vec3& lever, double stiffness,
                               std::vector<double>& elements, std::vector<double>& parts) const {
  const ContactPoint& point = list_.point(number);
  if (const std::optional<RigidPart>& rigid = surface_.rigid(point.part)) {
    if (rigid->free)
      parts[point.part] +=
          stiffness * (rigid->per_mass + (point.rest - rigid->centre).squaredNorm() * rigid->per_inertia);
    return;
  }
  const PointState& now = states_.points()[number];
  std::array<double, 8> of{};  // |b| of each element
  double sum = 0;
  for (std::uint32_t a = 0; a < point.at.count; ++a) {
    of[a] = std::abs(point.at.weights[a]);
    if (point.at.count == 8)
      of[a] += now.side.own_plane * std::abs(surface_.gradients(point.part)[a].dot(now.inverse * lever));
    sum += of[a];
  }
  for (std::uint32_t a = 0; a < point.at.count; ++a)
    elements[point.at.elements[a]] += stiffness * of[a] * sum;
}

double ContactStepBound::stiffness_bound() const {
  std::vector<double> elements(surface_.body().element_count(), 0), parts(surface_.body().parts.size(), 0);
  for (const std::uint32_t p : states_.active()) {
    const PairState& now = states_[p];
    const ContactPair& pair = list_.pairs()[p];
    const double stiffness =
        (pair.of_plane() ? 1 : 2) * (now.weight + kHardeningAhead * (now.stiffness - now.weight));
    const Vec3 lever = 0.5 * now.offset;
    add_row(pair.i, lever, stiffness, elements, parts);
    if (!pair.of_plane()) add_row(pair.j, lever, stiffness, elements, parts);
  }
  double largest = 0;
  for (const double part : parts) largest = std::max(largest, kRigidSafety * part);
  for (const std::uint32_t e : surface_.elements())
    largest = std::max(largest, elements[e] / surface_.mass(e));
  return damped(largest, settings_.damping);
}

// m/s, at most, of surfaces against one another.
double ContactStepBound::speed(const State& state) const {
  Box speeds;
  for (const std::uint32_t e : surface_.elements()) speeds.add(state.velocity[e]);
  if (!settings_.planes.empty()) speeds.add(Vec3::Zero());
  return speeds.diagonal();
}

double ContactStepBound::frequency(const State& state) {
  bound_ = stiffness_bound();
  checked_builds_ = list_.builds();
  const double motion = 2 * speed(state) / (kTravel * surface_.narrowest());
  return bound_ + motion * motion;
}

bool ContactStepBound::moves_too_far(const State& state) const {
  return speed(state) * state.kick > kMostTravel * surface_.narrowest();
}

bool ContactStepBound::is_exceeded() {
  double hardest = 0;
  for (const std::uint32_t p : states_.active())
    if (const PairState& now = states_[p]; now.weight > 0)
      hardest = std::max(hardest, now.stiffness / now.weight);
  if (checked() && hardest < kHardeningAhead) return false;
  checked_builds_ = list_.builds();
  return stiffness_bound() > 1.001 * bound_;
}

void ContactStepBound::restore(double bound, bool checked) {
  bound_ = bound;
  checked_builds_ = checked ? list_.builds() : list_.builds() - 1;
}

}  // namespace flexel::simulate
