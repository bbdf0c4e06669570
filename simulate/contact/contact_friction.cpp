// Velocities at the place where the points of a pair meet, and the forces there.
#include "simulate/contact/contact_friction.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace flexel::simulate {
namespace {

Vec3 at_most(const Vec3& value, double most) {
  const double norm = value.norm();
  return norm > most ? Vec3(value * (most / norm)) : value;
}

}  // namespace

ContactFriction::ContactFriction(double damping, const ContactSurface& surface, const PairList& list,
                                 PairStates& states, PairMemory& memory)
    : damping_(damping), surface_(surface), list_(list), states_(states), memory_(memory) {}

// From each point. A ball meets at its centre, which alone can carry a force; a shapeless point likewise.
std::array<Vec3, 2> ContactFriction::meeting_place(const ContactPair& pair) const {
  if (pair.of_plane()) return {Vec3::Zero(), Vec3::Zero()};
  const PointState &i = states_.points()[pair.i], &j = states_.points()[pair.j];
  const Vec3 d = j.side.position - i.side.position;
  const bool centred_i = i.side.radius > 0 || i.shapeless;
  const bool centred_j = j.side.radius > 0 || j.shapeless;
  const double share = centred_i == centred_j ? 0.5 : centred_i ? 0 : 1;
  return {share * d, (share - 1) * d};
}

// m/s, of j against i where they meet.
Vec3 ContactFriction::relative_velocity(const ContactPair& pair) const {
  const std::array<Vec3, 2> place = meeting_place(pair);
  const auto at = [&](std::uint32_t point, const Vec3& away) {
    const PointMotion& motion = states_.cells().motions()[point];
    return Vec3(motion.velocity + motion.gradient * away);
  };
  const Vec3 of_i = at(pair.i, place[0]);
  return pair.of_plane() ? Vec3(-of_i) : Vec3(at(pair.j, place[1]) - of_i);
}

// m, of the adhesive spring; 0 without one.
double ContactFriction::extension(std::size_t pair) const {
  return memory_[pair].sticks() ? std::max(states_[pair].gap - memory_[pair].adhesion, 0.0) : 0;
}

// N/m, of a pair that is pressed together or sticks: from the first touch on at least that of the linear
// range, so that a body that rests under little pressure does not sway.
double ContactFriction::secant_stiffness(std::size_t pair) const {
  const PairState& now = states_[pair];
  return std::max(now.share < 1 ? 0 : now.pressure / -now.gap, now.weight);
}

// N, along the surface, at which a pair slides: mu N and the traction of adhesion, less as it is extended.
double ContactFriction::largest_tangential(std::size_t pair) const {
  const PairProperties& properties = list_.pairs()[pair].properties;
  const double most = properties.friction * states_[pair].pressure;
  if (!memory_[pair].sticks()) return most;
  const double share = extension(pair) / properties.pull_off;
  return most + states_[pair].weight * properties.pull_off * std::sqrt(std::max(1 - share * share, 0.0));
}

// N, on j.
Vec3 ContactFriction::force(std::size_t pair) const {
  const PairState& now = states_[pair];
  const bool sticks = now.near && memory_[pair].sticks();
  if (!(now.pressure > 0) && !sticks) return Vec3::Zero();
  const ContactPair& of = list_.pairs()[pair];
  const double stiffness = secant_stiffness(pair);
  // the dashpot is as the contact's stiffness, less where the law begins softly
  const double share = sticks ? 1 : now.share;
  const Vec3 velocity = damping_ > 0 ? relative_velocity(of) : Vec3(Vec3::Zero());
  const double separating = velocity.dot(now.normal);
  double along = -damping_ * now.stiffness * share * separating - stiffness * extension(pair);
  if (!sticks) along = std::max(along, -now.pressure);
  const Vec3 sliding = velocity - separating * now.normal;
  const Vec3 held = memory_[pair].slip + damping_ * sliding;
  return along * now.normal - at_most(kTangential * stiffness * held, largest_tangential(pair));
}

// finish_step() finds what the next step asks for, unless an event changes velocities between them.
void ContactFriction::update(const State& state) {
  if (rubbed_ == states_.evaluations() &&
      (!(damping_ > 0) || same_bits(list_.runs(), state.velocity, velocities_)))
    return;
  states_.rub(state, damping_);
  hold(-1, false);
  take_velocities(state);
}

void ContactFriction::take_velocities(const State& state) {
  rubbed_ = states_.evaluations();
  velocities_.resize(list_.elements().size());
  if (damping_ > 0) gather(list_.runs(), state.velocity, velocities_);
}

void ContactFriction::hold(double drift, bool fresh) {
  if (!states_.others_act()) return;
  for (const std::uint32_t p : states_.active()) {
    const ContactPair& pair = list_.pairs()[p];
    if (!(pair.properties.pull_off > 0)) continue;
    if (drift >= 0) update_record(p, drift, fresh);
    const std::array<Vec3, 2> place = meeting_place(pair);
    PairRubbing& rubbing = states_.rubbing(p);
    rubbing = {force(p), place[0] - place[1], 0};
    if (rubbing.way != Vec3::Zero())
      rubbing.share = place[0] == Vec3::Zero() ? 0 : place[1] == Vec3::Zero() ? 1 : 0.5;
  }
  if (drift >= 0) states_.choose_acting();
}

void ContactFriction::finish_step(const State& state, double drift, bool active) {
  const bool fresh = std::exchange(fresh_, false);
  if (list_.pairs().empty() || !active) return;
  forget_separated();
  hold(drift, fresh);
  take_velocities(state);
  last_active_ = states_.active();
  last_builds_ = list_.builds();
}

void ContactFriction::update_record(std::size_t pair, double drift, bool fresh) {
  const PairState& now = states_[pair];
  const ContactPair& of = list_.pairs()[pair];
  PairRecord& record = memory_[pair];
  if (!(now.pressure > 0) && !(of.properties.pull_off > 0)) {
    record.release_adhesion();
    record.slip = Vec3::Zero();
    return;
  }
  // in the first step points that are nearly together touch
  const bool touches = now.gap < (fresh ? of.properties.constants.law.soft : 0);
  if (!(of.properties.pull_off > 0))
    record.release_adhesion();
  else if (!record.sticks() && touches)
    record.adhesion = std::max(now.gap, 0.0);
  const bool rubs = now.pressure > 0 && of.properties.friction > 0;
  Vec3 slip = Vec3::Zero();
  if (rubs || record.sticks()) {
    slip = record.slip + drift * relative_velocity(of);
    slip -= slip.dot(now.normal) * now.normal;
  }
  if (!(now.pressure > 0) && std::hypot(extension(pair), kTangential * slip.norm()) > of.properties.pull_off)
    record.release_adhesion();
  record.slip = rubs || record.sticks()
                    ? at_most(slip, largest_tangential(pair) / (kTangential * secant_stiffness(pair)))
                    : Vec3(Vec3::Zero());
}

// Pairs that are not near any more begin anew when they come back.
void ContactFriction::forget_separated() {
  const auto forget = [&](std::uint32_t p) {
    if (states_.is_active(p)) return;
    memory_[p].release_adhesion();
    memory_[p].slip = Vec3::Zero();
  };
  if (last_builds_ == list_.builds()) {
    for (const std::uint32_t p : last_active_) forget(p);
  } else {
    for (std::uint32_t p = 0; p < list_.pairs().size(); ++p) forget(p);
  }
}

}  // namespace flexel::simulate
