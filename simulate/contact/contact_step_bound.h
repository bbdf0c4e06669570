// Bound of the time step by the contacts.
//
// Stiffness: the largest eigenvalue of M^-1 sum k b b^T over the pairs, b the derivative of the gap by the
// elements, is at most the largest row sum of absolute values, sum k |b_a| sum_c |b_c| / m_a (Gershgorin).
// Active pairs that do not touch yet count as if they did. Motion: points pass each other by at most an eighth
// of the smallest spacing a step: the energy error of an impact, whose moment falls between steps, grows with
// the square of that.
#pragma once
#include "simulate/contact/pairs/pair_states.h"

namespace flexel::simulate {

class ContactStepBound {
 public:
  // All outlive this; pairs are evaluated for the states that are passed.
  ContactStepBound(const ContactSettings& settings, const ContactSurface& surface, const PairList& list,
                   const PairStates& states);

  // 1/s^2, added by the contacts to the square of the largest frequency, or what bounds the motion of a step.
  [[nodiscard]] double frequency();
  // Whether the motion of a step is too large, by the velocities that the list of pairs has seen last.
  [[nodiscard]] bool moves_too_far(const State& state) const;
  // Whether the contacts are stiffer than frequency() last said. Of a new list, all pairs are evaluated.
  [[nodiscard]] bool is_exceeded();

  // For checkpoints: 1/s^2, what the last frequency() said of the stiffness, whether the present list was
  // checked against it, and what of it is for hardening.
  [[nodiscard]] double bound() const { return bound_; }
  [[nodiscard]] bool checked() const { return checked_builds_ == list_.builds(); }
  [[nodiscard]] double hardening_bound() const { return hardening_; }
  void restore(double bound, bool checked, double hardening);

 private:
  template <class Stiffness>
  [[nodiscard]] double largest_row(const Stiffness& stiffness);
  void add_row(std::uint32_t number, const Vec3& lever, double stiffness);
  // 1/s^2, of the linear range; of what pairs have beyond it that are at least `least` times as stiff.
  [[nodiscard]] double linear();
  [[nodiscard]] double hardening(double least);
  [[nodiscard]] double speed() const;

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  const PairList& list_;
  const PairStates& states_;
  double bound_ = 0, hardening_ = 0;
  std::uint64_t checked_builds_ = 0;
  std::vector<double> elements_, parts_;  // of largest_row(); 0 beside it
};

}  // namespace flexel::simulate
