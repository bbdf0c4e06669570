// Pairs are grouped by a point and the part or plane on its other side.
#include "simulate/contact/pairs/overlap_release.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace flexel::simulate {
namespace {

constexpr double kKeepsPressing = 0.25;  // spacings beyond the allowed penetration that a new pair may have

}  // namespace

OverlapRelease::OverlapRelease(const ContactSettings& settings, const ContactSurface& surface,
                               const PairList& list)
    : settings_(settings), surface_(surface), list_(list) {}

std::vector<double> OverlapRelease::shares(const State& state) const {
  std::vector<double> shares;
  if (!enabled()) return shares;
  for (const double joined : joined_) {
    const double passed = std::clamp((state.time.value_or(0) - joined) / settings_.release_time, 0.0, 1.0);
    shares.push_back(1 - passed * passed * (3 - 2 * passed));
  }
  return shares;
}

std::vector<double> OverlapRelease::advance(const State& state) {
  return std::exchange(shares_, shares(state));
}

std::uint32_t OverlapRelease::later_part(const ContactPair& pair) const {
  const std::uint32_t i = list_.point(pair.i).part;
  if (pair.of_plane()) return i;
  const std::uint32_t j = list_.point(pair.j).part;
  return joined_[j] > joined_[i] ? j : i;
}

double OverlapRelease::allowed(const ContactPair& pair, const PairRecord& record) const {
  const double released = record.penetration - pair.rest_overlap;
  return released > 0 && !shares_.empty() ? pair.rest_overlap + shares_[later_part(pair)] * released
                                          : pair.rest_overlap;
}

// Of a pair's first point: a part, or numbered behind them a plane.
std::uint64_t OverlapRelease::other_side(const ContactPair& pair) const {
  return pair.of_plane() ? surface_.body().parts.size() + pair.plane : list_.point(pair.j).part;
}

void OverlapRelease::admit(const std::vector<std::uint32_t>& pairs, const std::vector<double>& depths,
                           PairMemory& memory) const {
  std::map<std::array<std::uint64_t, 2>, double> of_point, of_parts;  // m; point and other, part and other
  const auto deepen = [](double& depth, double other) { depth = std::max(depth, other); };
  for (std::size_t p = 0; p < list_.pairs().size(); ++p) {
    const double penetration = memory[p].penetration;
    if (!(penetration > 0)) continue;
    const ContactPair& pair = list_.pairs()[p];
    const std::uint64_t other = other_side(pair), part = list_.point(pair.i).part;
    deepen(of_point[{pair.i, other}], penetration);
    if (!pair.of_plane()) deepen(of_point[{pair.j, part}], penetration);
    deepen(of_parts[{part, other}], penetration);
  }
  const auto known = [&](std::uint64_t point, std::uint64_t other) {
    const auto found = of_point.find({point, other});
    return found == of_point.end() ? 0 : found->second;
  };
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    const ContactPair& pair = list_.pairs()[pairs[n]];
    const std::uint64_t other = other_side(pair), part = list_.point(pair.i).part;
    if (!of_parts.contains({part, other})) continue;
    const double share = shares_[later_part(pair)];
    double penetration = known(pair.i, other);
    if (!pair.of_plane()) deepen(penetration, known(pair.j, part));
    const bool far = depths[n] - share * penetration > kKeepsPressing * list_.point(pair.i).width;
    if (penetration == 0 || far) penetration = pair.rest_overlap + (depths[n] - pair.rest_overlap) / share;
    deepen(memory[pairs[n]].penetration, penetration);
  }
}

void OverlapRelease::enter_energy(const std::vector<double>& before, const std::vector<std::uint32_t>& active,
                                  const std::vector<PairState>& states, const PairMemory& memory) {
  if (shares_.empty() || before == shares_) return;
  std::vector<double> pressing(shares_.size(), 0);
  for (const std::uint32_t p : active) {
    const ContactPair& pair = list_.pairs()[p];
    pressing[later_part(pair)] +=
        states[p].pressure * std::max(memory[p].penetration - pair.rest_overlap, 0.0);
  }
  for (std::size_t p = 0; p < before.size(); ++p)  // none the first time
    energy_ += 0.5 * (before[p] - shares_[p]) * (pressing_[p] + pressing[p]);
  pressing_ = std::move(pressing);
}

void OverlapRelease::save(std::vector<double>& values) const {
  for (const std::vector<double>* each : {&joined_, &shares_, &pressing_})
    values.insert(values.end(), each->begin(), each->end());
}

void OverlapRelease::restore(std::span<const double> values, std::size_t joined, double energy) {
  const std::size_t shares = (values.size() - joined) / 2;
  const auto joined_end = values.begin() + static_cast<std::ptrdiff_t>(joined);
  const auto shares_end = joined_end + static_cast<std::ptrdiff_t>(shares);
  joined_.assign(values.begin(), joined_end);
  shares_.assign(joined_end, shares_end);
  pressing_.assign(shares_end, values.end());
  energy_ = energy;
}

}  // namespace flexel::simulate
