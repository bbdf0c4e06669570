// Pairs are evaluated in parallel and alone; only those that an initial penetration brings near wait for the
// others (OverlapRelease::admit).
#include "simulate/contact/pair_states.h"

#include <algorithm>

namespace flexel::simulate {
namespace {

constexpr double kSoftSteps = 2;       // in which an impact goes through the soft part of the contact law
constexpr double kFarthestSoft = 0.4;  // spacings, at most, of that part: two steps of contact_step_bound.cpp
constexpr double kHardening = 0.001;   // a step, of what rests: the share of its extra softness that goes
constexpr double kHardened = 1.01;     // of the least softness, at which that is over
constexpr double kShapelessEntry = 0.05;  // spacings; most penetration with which shapeless points approach

}  // namespace

PairStates::PairStates(const ContactSettings& settings, const ContactSurface& surface, const PairList& list,
                       PairMemory& memory, OverlapRelease& release)
    : settings_(settings), surface_(surface), list_(list), memory_(memory), release_(release) {}

void PairStates::reset() {
  states_.assign(list_.pairs().size(), PairState{});
  is_active_.assign(list_.pairs().size(), 0);
  active_.clear();
}

bool PairStates::evaluated(const State& state) {
  const std::vector<std::uint32_t>& elements = list_.elements();
  bool same =
      evaluated_builds_ == list_.builds() && release_.is_at(state) && evaluated_at_.size() == elements.size();
  for (std::size_t e = 0; same && e < evaluated_at_.size(); ++e)
    same = evaluated_at_[e] == state.displacement[elements[e]];
  if (same) return true;
  evaluated_builds_ = list_.builds();
  evaluated_at_.resize(elements.size());
  for (std::size_t e = 0; e < evaluated_at_.size(); ++e) evaluated_at_[e] = state.displacement[elements[e]];
  return false;
}

void PairStates::update(const State& state) {
  if (evaluated(state)) return;
  ++evaluations_;
  points_.resize(list_.points().size());
  parallel_for_each(
      points_.size(), [&](std::size_t n) { points_[n] = surface_.at(list_.points()[n], state); }, 512);
  if (release_.known_parts() < surface_.body().parts.size()) find_initial_penetrations(state);
  const std::vector<double> before = release_.advance(state);
  admit(evaluate_pairs());
  active_.clear();
  for (std::uint32_t p = 0; p < is_active_.size(); ++p)
    if (is_active_[p]) active_.push_back(p);
  release_.enter_energy(before, active_, states_, memory_);
}

// Returns (pairs; empty without release) 1 for those that come near inside each other during a release; they
// are not evaluated yet.
std::vector<std::uint8_t> PairStates::evaluate_pairs() {
  const std::vector<ContactPair>& pairs = list_.pairs();
  std::vector<std::uint8_t> entering(release_.share_count() == 0 ? 0 : pairs.size(), 0);
  parallel_for_each(
      pairs.size(),
      [&](std::size_t p) {
        PairRecord& record = memory_[p];
        if (out_of_reach(pairs[p])) {
          if (is_active_[p]) states_[p] = {};
          is_active_[p] = 0;
          record.phase = PairPhase::separated;
          record.soft = 0;
          return;
        }
        const PairState now = evaluate(pairs[p], release_.allowed(pairs[p], record), record.soft);
        const bool enters = now.near && !now.deep && now.gap < 0 && record.phase == PairPhase::separated;
        if (enters && record.penetration == 0 && release_.is_releasing(pairs[p]))
          entering[p] = 1;
        else
          set(p, now);
      },
      512);
  return entering;
}

void PairStates::admit(const std::vector<std::uint8_t>& entering) {
  std::vector<std::uint32_t> pairs;
  std::vector<double> depths;
  for (std::uint32_t p = 0; p < entering.size(); ++p)
    if (entering[p]) {
      pairs.push_back(p);
      depths.push_back(-evaluate(list_.pairs()[p], 0, 0).gap);
    }
  if (pairs.empty()) return;
  release_.admit(pairs, depths, memory_);
  for (const std::uint32_t p : pairs)
    set(p, evaluate(list_.pairs()[p], release_.allowed(list_.pairs()[p], memory_[p]), memory_[p].soft));
}

// In the first state; after an event, of the parts that have joined.
void PairStates::find_initial_penetrations(const State& state) {
  const std::size_t known = release_.known_parts();
  release_.add_parts(state.time.value_or(0));
  if (!release_.enabled()) return;
  parallel_for_each(
      list_.pairs().size(),
      [&](std::size_t p) {
        const ContactPair& pair = list_.pairs()[p];
        const std::uint32_t i = list_.point(pair.i).part;
        if (std::max(i, pair.of_plane() ? i : list_.point(pair.j).part) < known) return;
        const PairState now = evaluate(pair, 0, 0);
        if (now.near && !now.deep) memory_[p].penetration = std::max(-now.gap, 0.0);
      },
      512);
}

void PairStates::set(std::size_t pair, PairState now) {
  update_phase(list_.pairs()[pair], now, memory_[pair].phase);
  if (now.near)
    states_[pair] = now;
  else if (is_active_[pair])
    states_[pair] = {};
  if (!now.near) memory_[pair].soft = 0;
  is_active_[pair] = now.near;
}

// The phase after the state `now`; a penetrated pair has none.
void PairStates::update_phase(const ContactPair& pair, PairState& now, PairPhase& phase) const {
  if (!now.near) {
    phase = PairPhase::separated;
  } else if (now.deep) {
    phase = PairPhase::penetrated;
  } else if (now.gap >= 0) {
    phase = PairPhase::approaching;
  } else if (phase == PairPhase::separated) {
    const PairConstants& constants = pair.properties.constants;
    double entry = constants.law.hard;
    if (points_[pair.i].shapeless || (!pair.of_plane() && points_[pair.j].shapeless))
      entry = pair.of_plane() ? 0 : kShapelessEntry * constants.width;
    phase = -now.gap > entry ? PairPhase::penetrated : PairPhase::approaching;
  }
  if (phase == PairPhase::penetrated) now = {};
}

ContactSide PairStates::other_side(const ContactPair& pair) const {
  if (!pair.of_plane()) return points_[pair.j].side;
  const ContactPlane& plane = settings_.planes[pair.plane];
  const Vec3& from = points_[pair.i].side.position;
  return {from - (from - plane.point).dot(plane.normal) * plane.normal, plane.normal, 1, 0};
}

PairState PairStates::evaluate(const ContactPair& pair, double allowed, double soft) const {
  ContactSide from = points_[pair.i].side;
  if (pair.of_plane()) from.own_plane = 0;  // the plane's normal is the exact one
  if (!(allowed > 0) && !(soft > 0)) return pair_state(from, other_side(pair), pair.properties.constants);
  PairConstants constants = pair.properties.constants;
  constants.allowed = allowed;
  constants.law = constants.law.softened(soft);
  return pair_state(from, other_side(pair), constants);
}

// m/s, at which the points of a pair come together along `normal`.
double PairStates::approach(const ContactPair& pair, const Vec3& normal, const State& state) const {
  const auto velocity = [&](std::uint32_t number) {
    const InterpolationWeights& at = list_.point(number).at;
    Vec3 sum = Vec3::Zero();
    for (std::uint32_t a = 0; a < at.count; ++a) sum += at.weights[a] * state.velocity[at.elements[a]];
    return sum;
  };
  Vec3 of_j = Vec3::Zero();
  if (!pair.of_plane()) of_j = velocity(pair.j);
  return (velocity(pair.i) - of_j).dot(normal);
}

// A pair that is not pressed gets a soft part as wide as the way that it comes in kSoftSteps, but does not
// press where it is. One that is pressed keeps its own, for the energy it has stored is of that, and hardens
// slowly as it rests.
void PairStates::finish_step(const State& state, double drift) {
  parallel_for_each(
      active_.size(),
      [&](std::size_t n) {
        const std::uint32_t p = active_[n];
        const PairState& now = states_[p];
        double& soft = memory_[p].soft;
        const ContactPair& pair = list_.pairs()[p];
        const double least = pair.properties.constants.law.soft, width = list_.point(pair.i).width;
        if (now.pressure > 0) {
          soft -= kHardening * (soft - least);
          if (soft < kHardened * least) soft = 0;
          return;
        }
        const double most =
            std::min(std::max(soft, least + 2 * std::max(now.gap, 0.0)), kFarthestSoft * width);
        soft = 0;
        if (now.gap > kFarthestSoft * width) return;
        const double way = kSoftSteps * drift * approach(pair, now.normal, state);
        if (way > least) soft = std::min(way, most);
        if (soft <= least) soft = 0;
      },
      512);
}

// Whether the kernel is 0 for certain: |t|^2 = d^2 - (d . b)^2 / b^2, in the terms of pair_law.h, is beyond
// its width by more than rounding.
bool PairStates::out_of_reach(const ContactPair& pair) const {
  constexpr double kRounding = 1e-9;
  const double width = pair.properties.constants.width;
  if (pair.of_plane() || !(width > 0)) return false;
  const ContactSide &i = points_[pair.i].side, &j = points_[pair.j].side;
  const Vec3 d = j.position - i.position, b = i.own_plane * i.normal - j.own_plane * j.normal;
  const double d2 = d.squaredNorm(), b2 = b.squaredNorm(), along = d.dot(b);
  const double width2 = width * width;
  return d2 * b2 - along * along > (width2 + kRounding * (width2 + d2)) * b2;
}

}  // namespace flexel::simulate
