// How long a step the contacts allow.
//
// Stiffness: the largest eigenvalue of M^-1 sum k b b^T over the pairs, b the derivative of the gap by the
// elements, is at most the largest row sum of absolute values, sum k |b_a| sum_c |b_c| / m_a (Gershgorin).
// Pairs that are listed but do not touch yet count as if they did. Motion: points pass at most an eighth of
// the smallest spacing a step, against one another: what an impact gains or loses for want of a step at the
// moment of touching grows with the square of that.
#include <algorithm>

#include "simulate/contact/contacts.h"

namespace flexel::simulate {
namespace {

constexpr double kHardeningAhead = 1.3;              // of what hardens now, until it is looked at again
constexpr double kTravel = 0.12, kMostTravel = 0.2;  // spacings a step: what is asked for, what is borne

// omega^2 that bounds the step like a dashpot of tau beside a stiffness of omega^2 (time/stability.h).
double damped(double omega2, double tau) {
  const double zeta = 0.5 * tau * std::sqrt(omega2);
  const double factor = std::sqrt(1 + zeta * zeta) + zeta;
  return omega2 * factor * factor;
}

}  // namespace

double Contacts::stiffness_bound() const {
  std::vector<double> rows(body_.element_count(), 0), wholes(body_.parts.size(), 0);
  const auto add = [&](std::uint32_t near, const Vec3& lever, double stiffness) {
    const ContactPoint& point = points_[near_[near]];
    if (const std::optional<Whole>& whole = rigid_[point.part]) {
      if (whole->free)
        wholes[point.part] +=
            stiffness * (whole->per_mass + (point.rest - whole->centre).squaredNorm() * whole->per_inertia);
      return;
    }
    std::array<double, 8> of{};  // |b| of each element
    double sum = 0;
    for (std::uint32_t a = 0; a < point.at.count; ++a) {
      of[a] = std::abs(point.at.weights[a]);
      if (point.at.count == 8)
        of[a] +=
            sides_[near].at.own_plane * std::abs(gradients_[point.part][a].dot(sides_[near].inverse * lever));
      sum += of[a];
    }
    for (std::uint32_t a = 0; a < point.at.count; ++a) rows[point.at.elements[a]] += stiffness * of[a] * sum;
  };
  for (const std::uint32_t p : close_) {
    const PairState& now = states_[p];
    const bool plane = pairs_[p].j == kNoPoint;
    const double stiffness = (plane ? 1 : 2) * (now.weight + kHardeningAhead * (now.stiffness - now.weight));
    const Vec3 lever = 0.5 * now.offset;
    add(pairs_[p].i, lever, stiffness);
    if (!plane) add(pairs_[p].j, lever, stiffness);
  }
  double largest = 0;
  for (const double whole : wholes) largest = std::max(largest, whole);
  for (const std::uint32_t e : elements_) largest = std::max(largest, rows[e] / mass_[e]);
  return damped(largest, settings_.damping);
}

// m/s, at most, of surfaces against one another.
double Contacts::speed(const State& state) const {
  Box speeds;
  for (const std::uint32_t e : elements_) speeds.add(state.velocity[e]);
  if (!settings_.planes.empty()) speeds.add(Vec3::Zero());
  return speeds.diagonal();
}

double Contacts::frequency(const State& state) {
  if (points_.empty()) return 0;
  look(state);
  promised_ = stiffness_bound();
  looked_at_ = builds_;
  const double motion = 2 * speed(state) / (kTravel * narrowest_);
  return promised_ + motion * motion;
}

bool Contacts::needs_step_recheck(const State& state) {
  if (points_.empty()) return false;
  if (speed(state) * state.kick > kMostTravel * narrowest_) return true;
  look(state);
  double hardest = 0;
  for (const std::uint32_t p : close_)
    if (const PairState& now = states_[p]; now.weight > 0)
      hardest = std::max(hardest, now.stiffness / now.weight);
  if (looked_at_ == builds_ && hardest < kHardeningAhead) return false;
  looked_at_ = builds_;
  return stiffness_bound() > 1.001 * promised_;
}

}  // namespace flexel::simulate
