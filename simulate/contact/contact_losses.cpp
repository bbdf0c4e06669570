// Friction and damping of contacts, and what sticks.
//
// Both act at one place for either side, half way between the points, and along one line: momentum and
// angular momentum are kept. A force f at a place o from a point of a cell, o as it is now, moves element a
// by f (w_a + g_a . F^-1 o).
//
// Friction (Jansson and Vergeest, equations 4 and 20, with sticking added): a spring along the surface holds
// what touches where it first touched, stiff as 0.8 of the contact itself (Mindlin 1949: 0.8 at Poisson's
// ratio 1/3); where its force would pass mu N it slides and keeps that of mu N. Damping: a dashpot of tau
// times the contact's stiffness, along the normal and, while it sticks, along the surface. It never pulls.
//
// Sticking for good (Jansson and Vergeest, section 3.2: a connection made when elements meet, destroyed when
// they are t apart): what has touched is a spring, as stiff as the contact, that pulls until it is drawn out
// by t, where the traction is `stick`; along the surface it holds that traction beside mu N, and slides on.
#include <algorithm>
#include <utility>

#include "simulate/contact/contacts.h"

namespace flexel::simulate {
namespace {

constexpr double kAcross = 0.8;  // stiffness along the surface, of that along the normal

Vec3 at_most(const Vec3& value, double most) {
  const double norm = value.norm();
  return norm > most ? Vec3(value * (most / norm)) : value;
}

}  // namespace

// From each point to the place where they meet. A ball meets at its centre, which alone can carry a force,
// and so does what has no shape.
std::array<Vec3, 2> Contacts::meeting(const Pair& pair) const {
  if (pair.j == kNoPoint) return {Vec3::Zero(), Vec3::Zero()};
  const ContactSide &i = sides_[pair.i].at, &j = sides_[pair.j].at;
  const Vec3 d = j.position - i.position;
  const bool ball_i = i.radius > 0 || sides_[pair.i].shapeless;
  const bool ball_j = j.radius > 0 || sides_[pair.j].shapeless;
  const double share = ball_i == ball_j ? 0.5 : ball_i ? 0 : 1;
  return {share * d, (share - 1) * d};
}

// What remember() asks for at the end of a step add_losses() asks for at the beginning of the next.
void Contacts::find_motions(const State& state) {
  bool same = moved_looks_ == looks_ && moving_.size() == near_elements_.size();
  for (std::size_t e = 0; same && e < moving_.size(); ++e)
    same = moving_[e] == state.velocity[near_elements_[e]];
  if (same) return;
  moved_looks_ = looks_;
  moving_.resize(near_elements_.size());
  for (std::size_t e = 0; e < moving_.size(); ++e) moving_[e] = state.velocity[near_elements_[e]];
  motions_.assign(near_.size(), Motion{});
  parallel_for_each(
      near_.size(),
      [&](std::size_t n) {
        const ContactPoint& point = points_[near_[n]];
        Motion& motion = motions_[n];
        for (std::uint32_t a = 0; a < point.at.count; ++a)
          motion.velocity += point.at.weights[a] * state.velocity[point.at.elements[a]];
        if (point.at.count != 8) return;
        for (std::size_t a = 0; a < 8; ++a)
          motion.gradient += state.velocity[point.at.elements[a]] * gradients_[point.part][a].transpose();
        motion.gradient *= sides_[n].inverse;
      },
      512);
}

// Of j against i where they meet.
Vec3 Contacts::relative_velocity(const Pair& pair) const {
  const std::array<Vec3, 2> place = meeting(pair);
  const auto at = [&](std::uint32_t near, const Vec3& away) {
    return Vec3(motions_[near].velocity + motions_[near].gradient * away);
  };
  const Vec3 of_i = at(pair.i, place[0]);
  return pair.j == kNoPoint ? Vec3(-of_i) : Vec3(at(pair.j, place[1]) - of_i);
}

// m, that a pair that sticks is drawn out; 0 of others.
double Contacts::drawn(std::size_t pair) const {
  const double stuck = memory_[pair].stuck;
  return stuck == kFree ? 0 : std::max(states_[pair].gap - stuck, 0.0);
}

// N/m, of a pair that is pressed together or sticks: from the first touch on what it is where it is linear,
// so that what rests on little pressure does not sway.
double Contacts::secant(std::size_t pair) const {
  const PairState& now = states_[pair];
  return std::max(now.pressure > 0 ? now.pressure / -now.gap : 0, now.weight);
}

// N, along the surface, at which a pair slides: mu N and what sticks holds, less as it is drawn out.
double Contacts::most_across(std::size_t pair) const {
  const double most = pairs_[pair].friction * states_[pair].pressure;
  if (memory_[pair].stuck == kFree) return most;
  const double share = drawn(pair) / pairs_[pair].holds;
  return most + states_[pair].weight * pairs_[pair].holds * std::sqrt(std::max(1 - share * share, 0.0));
}

void Contacts::add_losses(const State& state, std::vector<Vec3>& forces) {
  look(state);
  if (close_.empty()) return;
  if (settings_.damping > 0) find_motions(state);
  std::vector<Vec3> found(close_.size(), Vec3::Zero());  // N, on j
  parallel_for_each(
      close_.size(),
      [&](std::size_t c) {
        const std::uint32_t p = close_[c];
        const PairState& now = states_[p];
        const bool pressed = now.pressure > 0, sticks = now.near && memory_[p].stuck != kFree;
        if (!pressed && !sticks) return;
        const Pair& pair = pairs_[p];
        const double stiffness = secant(p);
        // of the dashpot: as stiff as the contact is where it begins softly
        const double depth = sticks ? 1 : std::min(-now.gap / pair.constants.law.soft, 1.0);
        const Vec3 velocity = settings_.damping > 0 ? relative_velocity(pair) : Vec3(Vec3::Zero());
        const double apart = velocity.dot(now.normal);
        // on j, along the normal
        double along = -settings_.damping * now.stiffness * depth * apart - stiffness * drawn(p);
        if (!sticks) along = std::max(along, -now.pressure);
        const Vec3 across = velocity - apart * now.normal;
        const Vec3 held = memory_[p].stretch + settings_.damping * across;
        found[c] = along * now.normal - at_most(kAcross * stiffness * held, most_across(p));
      },
      512);
  std::vector<Total> totals(near_.size());
  for (std::size_t c = 0; c < close_.size(); ++c) {
    if (found[c] == Vec3::Zero()) continue;
    const Pair& pair = pairs_[close_[c]];
    const std::array<Vec3, 2> place = meeting(pair);
    totals[pair.i].force -= found[c];
    totals[pair.i].couple -= found[c] * place[0].transpose();
    if (pair.j == kNoPoint) continue;
    totals[pair.j].force += found[c];
    totals[pair.j].couple += found[c] * place[1].transpose();
  }
  spread(state, totals, forces);
}

void Contacts::remember(const State& state, double drift) {
  look(state);
  const bool fresh = std::exchange(fresh_, false);
  if (pairs_.empty() || !loses()) return;
  forget_parted();
  find_motions(state);
  parallel_for_each(
      close_.size(),
      [&](std::size_t c) {
        const std::uint32_t p = close_[c];
        const PairState& now = states_[p];
        const Pair& pair = pairs_[p];
        Memory& memory = memory_[p];
        // at the beginning what lies there touches, give or take
        const bool touches = now.gap < (fresh ? pair.constants.law.soft : 0);
        if (!(pair.holds > 0))
          memory.stuck = kFree;
        else if (memory.stuck == kFree && touches)
          memory.stuck = std::max(now.gap, 0.0);
        const bool rubs = now.pressure > 0 && pair.friction > 0;
        Vec3 stretch = Vec3::Zero();
        if (rubs || memory.stuck != kFree) {
          stretch = memory.stretch + drift * relative_velocity(pair);
          stretch -= stretch.dot(now.normal) * now.normal;
        }
        if (!(now.pressure > 0) && std::hypot(drawn(p), kAcross * stretch.norm()) > pair.holds)
          memory.stuck = kFree;
        memory.stretch = rubs || memory.stuck != kFree
                             ? at_most(stretch, most_across(p) / (kAcross * secant(p)))
                             : Vec3(Vec3::Zero());
      },
      512);
  remembered_ = close_;
  remembered_builds_ = builds_;
}

// Pairs that are not near any more begin anew when they come back.
void Contacts::forget_parted() {
  const auto forget = [&](std::uint32_t p) {
    if (is_close_[p]) return;
    memory_[p].stuck = kFree;
    memory_[p].stretch = Vec3::Zero();
  };
  if (remembered_builds_ == builds_) {
    for (const std::uint32_t p : remembered_) forget(p);
  } else {
    for (std::uint32_t p = 0; p < pairs_.size(); ++p) forget(p);
  }
}

}  // namespace flexel::simulate
