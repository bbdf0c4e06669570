// Parts that begin inside each other are let out: every pair remembers how deep it began, and presses only
// beyond a share of that which falls from 1 to 0 along a cubic. What the contacts store grows by that beside
// the work of their forces; the books have it as work of "overlap". Pairs that come near later, because what
// is let out slides meanwhile, take what their points remember in others.
#include <algorithm>
#include <map>
#include <utility>

#include "simulate/contact/contacts.h"

namespace flexel::simulate {
namespace {

constexpr double kKeepsPressing = 0.25;  // spacings that a new pair may be deeper than is allowed for

}  // namespace

// (parts) a part that an event has added is let out from then on.
std::vector<double> Contacts::shares(const State& state) const {
  std::vector<double> shares;
  if (!(settings_.parting > 0)) return shares;
  for (const double joined : joined_) {
    const double passed = std::clamp((state.time.value_or(0) - joined) / settings_.parting, 0.0, 1.0);
    shares.push_back(1 - passed * passed * (3 - 2 * passed));
  }
  return shares;
}

std::uint32_t Contacts::later_part(const Pair& pair) const {
  const std::uint32_t i = points_[near_[pair.i]].part;
  if (pair.j == kNoPoint) return i;
  const std::uint32_t j = points_[near_[pair.j]].part;
  return joined_[j] > joined_[i] ? j : i;
}

double Contacts::allowed(std::size_t pair) const {
  const double inside = memory_[pair].inside;
  return inside > 0 && !shares_.empty() ? shares_[later_part(pairs_[pair])] * inside : 0;
}

// In the first look, of the sides as they are then; after an event, of the parts that have joined.
void Contacts::find_inside(const State& state) {
  const std::size_t known = joined_.size();
  joined_.resize(body_.parts.size(), state.time.value_or(0));
  if (!(settings_.parting > 0)) return;
  parallel_for_each(
      pairs_.size(),
      [&](std::size_t p) {
        const Pair& pair = pairs_[p];
        const std::uint32_t i = points_[near_[pair.i]].part;
        if (std::max(i, pair.j == kNoPoint ? i : points_[near_[pair.j]].part) < known) return;
        const PairState now = state_of(p, 0);
        if (now.near && !now.deep) memory_[p].inside = std::max(-now.gap, 0.0);
      },
      512);
}

// What lies on the other side of a pair's first point: a part, or beyond them a plane.
std::uint64_t Contacts::other_of(const Pair& pair) const {
  return pair.j == kNoPoint ? body_.parts.size() + pair.plane : points_[near_[pair.j]].part;
}

// `pairs` have come near while they are inside each other, between parts some of which are being let out. One
// goes on with what its points began at in the other part; where they did not, or it is far deeper than that,
// it begins to press from where it is.
void Contacts::let_in(const std::vector<std::uint32_t>& pairs) {
  std::map<std::array<std::uint64_t, 2>, double> of_point, of_parts;  // m; point and other, part and other
  const auto deepen = [](double& inside, double other) { inside = std::max(inside, other); };
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const double inside = memory_[p].inside;
    if (!(inside > 0)) continue;
    const Pair& pair = pairs_[p];
    const std::uint64_t other = other_of(pair), part = points_[near_[pair.i]].part;
    deepen(of_point[{pair.i, other}], inside);
    if (pair.j != kNoPoint) deepen(of_point[{pair.j, part}], inside);
    deepen(of_parts[{part, other}], inside);
  }
  const auto begun = [&](std::uint64_t point, std::uint64_t other) {
    const auto found = of_point.find({point, other});
    return found == of_point.end() ? 0 : found->second;
  };
  std::vector<double> inside(pairs.size(), 0);
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const std::uint32_t p = pairs[n];
    const Pair& pair = pairs_[p];
    const std::uint64_t other = other_of(pair), part = points_[near_[pair.i]].part;
    if (!of_parts.contains({part, other})) continue;
    const double share = shares_[later_part(pair)], depth = -state_of(p, 0).gap;
    inside[n] = begun(pair.i, other);
    if (pair.j != kNoPoint) deepen(inside[n], begun(pair.j, part));
    const bool far = depth - share * inside[n] > kKeepsPressing * points_[near_[pair.i]].width;
    if (inside[n] == 0 || far) inside[n] = depth / share;
  }
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const std::uint32_t p = pairs[n];
    deepen(memory_[p].inside, inside[n]);
    take_state(p, state_of(p, allowed(p)));
  }
}

// What the fall of the shares from `before` has put in: the mean of what presses before and after the step,
// as the books enter the work of forces.
void Contacts::book_letting_out(const std::vector<double>& before) {
  if (shares_.empty() || before == shares_) return;
  std::vector<double> pressing(shares_.size(), 0);  // J a share
  for (const std::uint32_t p : close_)
    if (memory_[p].inside > 0) pressing[later_part(pairs_[p])] += states_[p].pressure * memory_[p].inside;
  for (std::size_t p = 0; p < before.size(); ++p)  // none at the first look
    put_in_ += 0.5 * (before[p] - shares_[p]) * (pressing_[p] + pressing[p]);
  pressing_ = std::move(pressing);
}

double Contacts::injected_energy(const State& state) {
  look(state);
  return std::exchange(put_in_, 0);
}

}  // namespace flexel::simulate
