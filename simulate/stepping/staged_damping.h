// Damping in stages, for damping times that would cut an explicit step short.
//
// Over a step dt the elastic and outer forces f are those of its start, and M dv/dt = f + D v, linear in the
// velocities, is passed through in s explicit stages of lengths dt_j (the first-order Chebyshev methods of van der
// Houwen and Sommeijer 1980):
//     v+ = P v- + (1 - P) Z^-1 dt M^-1 f,   Z = -dt M^-1 D,   P(z) = T_s(w0 - w1 z) / T_s(w0)
// with T_s(w0) = 1 / kRipple, w1 = T_s(w0) / T_s'(w0), dt_j = dt w1 / (w0 - cos((2 j - 1) pi / (2 s))). |P| is at
// most kRipple from where it first falls so far to z = (1 + w0) / w1, about 0.87 s^2. P is exp(-z) to first order
// and within 0.3 z^2; what is overdamped creeps as fast as f and D v balance, for every P. The stages come in Leja's
// order, so that rounding is not amplified by more than their number squared. Momentum is kept to rounding.
//
// A step is the explicit one of the mass M (1 - P)^-1 Z >= M, and so stable where dt^2 K <= F(Z) M, F(z) = 2 z
// (1 + P) / (1 - P), which is at least kLeast for every s and z (tests/simulate/staged_damping_test.cpp).
#pragma once
#include <vector>

#include "simulate/stepping/prescribed_motion.h"
#include "simulate/stepping/stepper.h"

namespace flexel::simulate {

// Lengths of the stages, as shares of the step, for z up to `largest`, more than 0. Throws DivergedError: they are
// too many.
[[nodiscard]] std::vector<double> damping_stages(double largest);

class StagedDamping {
 public:
  static constexpr double kRipple = 0.2;
  static constexpr double kLeast = 2.78;  // of dt^2 omega^2, in place of the 4 of undamped steps

  // Both must outlive it. `book`: damping_force() is asked for; the stepper needs a book too.
  StagedDamping(Stepper& stepper, const PrescribedMotion& held, bool book)
      : stepper_(stepper), held_(held), book_(book) {}

  // One step, to the time `end` [s]: velocities to v+, displacements by `drift` times them. `rate` [1/s] bounds the
  // eigenvalues of -M^-1 D. Velocities of held components are left as if free, for PrescribedMotion::impose.
  StepOutcome advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance, double end,
                      double rate);

  [[nodiscard]] std::size_t stages() const { return stages_.size(); }  // of the last step
  // N (elements), the mean of the last step; empty without a book.
  [[nodiscard]] const std::vector<Vec3>& damping_force() const { return force_; }

 private:
  void find_stages(double largest);

  Stepper& stepper_;
  const PrescribedMotion& held_;
  bool book_;
  double largest_ = 0;                       // z that the stages are for
  std::vector<double> stages_;               // shares of the step
  std::vector<Vec3> path_, pulled_, force_;  // (elements) m/s, m/s, N
};

}  // namespace flexel::simulate
