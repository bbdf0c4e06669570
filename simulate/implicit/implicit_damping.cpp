// Conjugate gradients preconditioned by the masses; sums in a fixed order.
#include "simulate/implicit/implicit_damping.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/effects/effect.h"
#include "simulate/linear/vector_products.h"
#include "simulate/stepping/failure_messages.h"

namespace flexel::simulate {
namespace {

constexpr double kDampingTolerance = 1e-6;  // of the residual in the norm of the inverse masses

bool is_zero(const std::vector<Vec3>& values) {
  return std::all_of(values.begin(), values.end(), [](const Vec3& v) { return v == Vec3::Zero(); });
}

// The first that is not finite, or else the longest.
std::size_t largest(const std::vector<Vec3>& values) {
  std::size_t at = 0;
  for (std::size_t e = 0; e < values.size(); ++e) {
    if (!values[e].allFinite()) return e;
    if (values[e].squaredNorm() > values[at].squaredNorm()) at = e;
  }
  return at;
}

}  // namespace

const std::vector<Vec3>& ImplicitDamping::damping(const std::vector<Vec3>& velocity) {
  probe_.velocity = velocity;
  (void)stepper_.advance(probe_, {}, {0, 0, false});
  return stepper_.damping_force();
}

StepOutcome ImplicitDamping::advance(State& state, const std::vector<Vec3>& outer,
                                     const step::Advance& advance, double time) {
  const std::vector<double>&mass = stepper_.mass(), &inverse = stepper_.inverse_mass();
  const double dt = advance.kick;
  const std::size_t n = state.velocity.size();
  before_ = state.velocity;
  probe_.displacement = state.displacement;
  const StepOutcome outcome = stepper_.advance(state, outer, {dt, 0, false});  // v- + dt / m (f + D v-)
  const ScopeTimer timer(seconds_);
  state.time = time;
  right_.resize(n);
  residual_.resize(n);
  direction_.resize(n);
  image_.resize(n);
  parallel_for_each(n, [&](std::size_t e) { right_[e] = mass[e] * (state.velocity[e] - before_[e]); });

  // Prescribed components are known: what their change pulls along goes to the right-hand side of the others.
  if (change_.size() != n) change_.assign(n, Vec3::Zero());
  direction_ = before_;
  held_.impose_velocity(state, advance.drift, direction_);
  parallel_for_each(n, [&](std::size_t e) { direction_[e] -= before_[e]; });
  held_.copy(direction_, change_);
  if (!is_zero(direction_)) {
    const std::vector<Vec3>& pulled = damping(direction_);
    parallel_for_each(n, [&](std::size_t e) { right_[e] += dt * pulled[e]; });
  }
  held_.clear(right_);
  image_ = change_;
  held_.clear(image_);
  const std::vector<Vec3>& first = damping(image_);
  parallel_for_each(n,
                    [&](std::size_t e) { residual_[e] = right_[e] + dt * first[e] - mass[e] * image_[e]; });
  held_.clear(residual_);
  solve_for_change(dt);
  // What the forces make of the held components as if they were free: the damping at v+ in place of that at
  // v-. The former stays with the stepper, for the books.
  const std::vector<Vec3>& then = damping(before_);
  parallel_for_each(n, [&](std::size_t e) {
    image_[e] = state.velocity[e] - dt * inverse[e] * then[e];
    state.velocity[e] = before_[e] + change_[e];
  });
  const std::vector<Vec3>& now = damping(state.velocity);
  parallel_for_each(n, [&](std::size_t e) { image_[e] += dt * inverse[e] * now[e]; });
  held_.copy(image_, state.velocity);
  parallel_for_each(n, [&](std::size_t e) { state.displacement[e] += advance.drift * state.velocity[e]; });
  return outcome;
}

void ImplicitDamping::solve_for_change(double dt) {
  const std::vector<double>&mass = stepper_.mass(), &inverse = stepper_.inverse_mass();
  const std::size_t n = change_.size();
  const double enough = kDampingTolerance * kDampingTolerance * weighted_dot(right_, right_, inverse);
  double norm = weighted_dot(residual_, residual_, inverse);
  parallel_for_each(n, [&](std::size_t e) { direction_[e] = inverse[e] * residual_[e]; });
  for (int i = 0; norm > enough; ++i) {
    if (i == most_ || !std::isfinite(norm))
      throw DivergedError(damping_unsolved_at(held_.body().rest[largest(residual_)], i));
    ++iterations_;
    const std::vector<Vec3>& damped = damping(direction_);
    parallel_for_each(n, [&](std::size_t e) { image_[e] = mass[e] * direction_[e] - dt * damped[e]; });
    held_.clear(image_);
    const double length = norm / dot(direction_, image_);
    parallel_for_each(n, [&](std::size_t e) {
      change_[e] += length * direction_[e];
      residual_[e] -= length * image_[e];
    });
    const double next = weighted_dot(residual_, residual_, inverse);
    const double share = next / norm;
    parallel_for_each(
        n, [&](std::size_t e) { direction_[e] = inverse[e] * residual_[e] + share * direction_[e]; });
    norm = next;
  }
}

}  // namespace flexel::simulate
