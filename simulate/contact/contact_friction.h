// Friction, damping and adhesion of contacts.
//
// They act on both sides at one place, half way between the points, and along one line: momentum and angular
// momentum are kept.
//
// Friction (Jansson and Vergeest, equations 4 and 20, with sticking added): a spring along the surface holds
// the points where they first touched, with 0.8 of the stiffness of the contact (Mindlin 1949: 0.8 at Poisson's
// ratio 1/3); where its force would exceed mu N they slide and it stays at mu N. Damping: a dashpot of tau
// times the contact's stiffness, along the normal and, while the pair sticks, along the surface. Without
// adhesion it never pulls.
//
// Adhesion (Jansson and Vergeest, section 3.2: a connection made when elements meet, destroyed when they are t
// apart): points that have touched are joined by a spring, as stiff as the contact, that pulls until its
// extension is t, where the traction is `stick`; along the surface it holds that traction beside mu N, and
// slides beyond.
#pragma once
#include "simulate/contact/contact_loads.h"

namespace flexel::simulate {

constexpr double kTangential = 0.8;  // stiffness of a pair along the surface, of that along the normal

class ContactFriction {
 public:
  // All but `damping` [s] outlive this; slip and adhesion are kept in `memory`.
  ContactFriction(double damping, const ContactSurface& surface, const PairList& list, PairStates& states,
                  PairMemory& memory);

  // Brings PairStates::rubbing() to `state`, for which the pairs have been evaluated.
  void update(const State& state);
  // After a step of `drift` s that led to `state`, which the pairs have gone through. `active`: whether
  // anything dissipates at all.
  void finish_step(const State& state, double drift, bool active);

  // Of an active pair under pressure: from each of its points where they meet [m]; N/m, of the pair along its
  // normal, from no pressure to the present one.
  [[nodiscard]] std::array<Vec3, 2> meeting_place(const ContactPair& pair) const;
  [[nodiscard]] double secant_stiffness(std::size_t pair) const;

  // For checkpoints: whether no step has been finished.
  [[nodiscard]] bool fresh() const { return fresh_; }
  void set_fresh(bool fresh) { fresh_ = fresh; }

 private:
  // Of what may stick, one by one; with slips and adhesion brought up to date, where `drift` [s] is not
  // negative.
  void hold(double drift, bool fresh);
  void take_velocities(const State& state);
  void forget_separated();
  void update_record(std::size_t pair, double drift, bool fresh);
  [[nodiscard]] Vec3 force(std::size_t pair) const;
  [[nodiscard]] Vec3 relative_velocity(const ContactPair& pair) const;
  [[nodiscard]] double extension(std::size_t pair) const;
  [[nodiscard]] double largest_tangential(std::size_t pair) const;

  double damping_;
  const ContactSurface& surface_;
  const PairList& list_;
  PairStates& states_;
  PairMemory& memory_;
  std::uint64_t rubbed_ = 0;      // the evaluation that rubbing() is of
  std::vector<Vec3> velocities_;  // (PairList::elements()) likewise
  // Active pairs of the last finish_step(), in the list of this number.
  std::vector<std::uint32_t> last_active_;
  std::uint64_t last_builds_ = 0;
  bool fresh_ = true;
};

}  // namespace flexel::simulate
