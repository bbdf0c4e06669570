// Rows of elements, and of free rigid parts as a whole; those of what is beyond the linear range by themselves.
#include "simulate/contact/contact_step_bound.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexel::simulate {
namespace {

constexpr double kLinearAhead = 1.1, kHardeningAhead = 1.3;  // growth until the next check
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

void ContactStepBound::add_row(std::uint32_t number, const Vec3& lever, double stiffness) {
  const ContactPoint& point = list_.point(number);
  if (const std::optional<RigidPart>& rigid = surface_.rigid(point.part)) {
    if (rigid->free)
      parts_[point.part] +=
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
    elements_[point.at.elements[a]] += stiffness * of[a] * sum;
}

// 1/s^2, the largest row of the evaluated pairs, stiffness(pair) [N/m] each; 0 leaves one out.
template <class Stiffness>
double ContactStepBound::largest_row(const Stiffness& stiffness) {
  elements_.resize(surface_.body().element_count(), 0);
  parts_.assign(surface_.body().parts.size(), 0);
  bool any = false;
  for (const std::uint32_t p : states_.active()) {
    const double own = stiffness(states_[p]);
    if (!(own > 0)) continue;
    any = true;
    const ContactPair& pair = list_.pairs()[p];
    const Vec3 lever = 0.5 * states_[p].offset;
    add_row(pair.i, lever, (pair.of_plane() ? 1 : 2) * own);
    if (!pair.of_plane()) add_row(pair.j, lever, 2 * own);
  }
  if (!any) return 0;
  double largest = 0;
  for (const double part : parts_) largest = std::max(largest, kRigidSafety * part);
  for (const std::uint32_t e : surface_.elements())
    largest = std::max(largest, std::exchange(elements_[e], 0.0) / surface_.mass(e));
  return largest;
}

double ContactStepBound::linear() {
  return largest_row([](const PairState& pair) { return pair.weight; });
}

double ContactStepBound::hardening(double least) {
  return largest_row([&](const PairState& pair) {
    return pair.stiffness > least * pair.weight ? pair.stiffness - pair.weight : 0;
  });
}

// m/s, at most, of surfaces against one another.
double ContactStepBound::speed() const {
  Box speeds = list_.speeds();
  if (!settings_.planes.empty()) speeds.add(Vec3::Zero());
  return speeds.diagonal();
}

double ContactStepBound::frequency() {
  hardening_ = kHardeningAhead * hardening(1);
  bound_ = damped(kLinearAhead * linear() + hardening_, settings_.damping);
  checked_builds_ = list_.builds();
  const double motion = 2 * speed() / (kTravel * surface_.narrowest());
  return bound_ + motion * motion;
}

bool ContactStepBound::moves_too_far(const State& state) const {
  return speed() * state.kick > kMostTravel * surface_.narrowest();
}

bool ContactStepBound::is_exceeded() {
  static_assert(kHardeningAhead > contact_kernels::kStiffening);
  if (checked()) return states_.stiffens() && hardening(kHardeningAhead) > hardening_;
  checked_builds_ = list_.builds();
  return damped(linear() + hardening(1), settings_.damping) > 1.001 * bound_;
}

void ContactStepBound::restore(double bound, bool checked, double hardening) {
  bound_ = bound;
  checked_builds_ = checked ? list_.builds() : list_.builds() - 1;
  hardening_ = hardening;
}

}  // namespace flexel::simulate
