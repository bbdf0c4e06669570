// Each stage is an advance of the stepper; the last one moves the elements too.
#include "simulate/stepping/staged_damping.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/stepping/failure_messages.h"

namespace flexel::simulate {
namespace {

constexpr int kMostStages = 2000;

struct Chebyshev {
  double w0 = 0, w1 = 0;
  [[nodiscard]] double largest() const { return (1 + w0) / w1; }
};

Chebyshev chebyshev(int stages) {
  const double angle = std::acosh(1 / StagedDamping::kRipple);  // T_s(cosh(x)) = cosh(s x)
  const double part = angle / stages;
  return {std::cosh(part), std::sinh(part) / (StagedDamping::kRipple * stages * std::sinh(angle))};
}

// Each as far as may be from those before it, by the product of distances: first the largest.
std::vector<double> in_leja_order(std::vector<double> values) {
  std::vector<double> distance(values.size(), 0);  // sum of logarithms
  for (std::size_t n = 0; n < values.size(); ++n) {
    const auto best =
        n == 0 ? std::max_element(values.begin(), values.end()) - values.begin()
               : std::max_element(distance.begin() + static_cast<std::ptrdiff_t>(n), distance.end()) -
                     distance.begin();
    std::swap(values[n], values[static_cast<std::size_t>(best)]);
    std::swap(distance[n], distance[static_cast<std::size_t>(best)]);
    for (std::size_t m = n + 1; m < values.size(); ++m)
      distance[m] += std::log(std::abs(values[m] - values[n]));
  }
  return values;
}

}  // namespace

std::vector<double> damping_stages(double largest) {
  int count = 2;
  while (count <= kMostStages && !(chebyshev(count).largest() >= largest)) ++count;
  if (count > kMostStages) throw DivergedError(damping_too_long(kMostStages));
  const Chebyshev made = chebyshev(count);
  std::vector<double> roots;  // of P
  for (int j = 1; j <= count; ++j)
    roots.push_back((made.w0 - std::cos((2 * j - 1) * std::numbers::pi / (2 * count))) / made.w1);
  std::vector<double> shares = in_leja_order(std::move(roots));
  for (double& share : shares) share = 1 / share;
  return shares;
}

void StagedDamping::find_stages(double largest) {
  if (largest == largest_) return;
  stages_ = damping_stages(largest);
  largest_ = largest;
}

StepOutcome StagedDamping::advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance,
                                   double end, double rate) {
  find_stages(advance.kick * rate);
  const std::size_t n = state.velocity.size();
  state.time = end;
  path_.resize(n);
  pulled_.resize(n);
  held_.impose_velocity(state, advance.drift, path_);
  held_.copy(state.velocity, pulled_);
  if (book_) force_.assign(n, Vec3::Zero());
  StepOutcome whole;
  for (std::size_t stage = 0; stage < stages_.size(); ++stage) {
    const double length = stages_[stage];
    held_.copy(path_, state.velocity);
    const double drift = stage + 1 == stages_.size() ? advance.drift : 0;
    StepOutcome one = stepper_.advance(state, outer, {length * advance.kick, drift, false});
    held_.add_change(path_, state.velocity, pulled_);
    if (book_)
      parallel_for_each(n, [&](std::size_t e) { force_[e] += length * stepper_.damping_force()[e]; });
    // what flows does so in the first stage, for the others have the same shape; broken cells are told once
    if (stage == 0) whole = one;
  }
  held_.copy(pulled_, state.velocity);
  return whole;
}

}  // namespace flexel::simulate
