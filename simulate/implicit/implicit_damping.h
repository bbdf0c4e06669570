// Damping taken implicitly, for damping times that would cut an explicit step short.
//
// With the elastic and outer forces f at the state before the step and the damping D v, linear in the
// velocities,
//     (M - dt D) x = dt (f + D v-),   v+ = v- + x
// by conjugate gradients, D without a matrix by the kernel. M - dt D is symmetric and positive definite, for
// damping only takes energy; its condition is 1 + dt tau omega^2. The previous step's x is where the search
// starts. Components that follow a path are no unknowns: the right-hand side of the others, against which
// their residual is measured, has what they pull along.
#pragma once
#include <vector>

#include "simulate/stepping/prescribed_motion.h"
#include "simulate/stepping/stepper.h"

namespace flexel::simulate {

class ImplicitDamping {
 public:
  static constexpr int kIterations = 5000;

  // `stepper` needs a book (its damping forces are read), and must outlive it, as must `held`. `iterations`:
  // of a step, at most.
  ImplicitDamping(Stepper& stepper, const PrescribedMotion& held, int iterations = kIterations)
      : stepper_(stepper), held_(held), most_(iterations) {}

  // One step: velocities to v+, displacements by `drift` times them. `state.time` becomes `time`. Velocities
  // of held components are left as if free, for PrescribedMotion::impose. Throws DivergedError where the search does not
  // end.
  StepOutcome advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance,
                      double time);

  [[nodiscard]] std::uint64_t iterations() const { return iterations_; }  // of all steps
  [[nodiscard]] double seconds() const { return seconds_; }  // likewise, beyond those of an explicit step
  // Where the next search starts [m/s] (elements; or none before the first step).
  [[nodiscard]] const std::vector<Vec3>& change() const { return change_; }
  void set_change(std::vector<Vec3> change) { change_ = std::move(change); }

 private:
  // D v [N] (elements) at the displacements of probe_.
  const std::vector<Vec3>& damping(const std::vector<Vec3>& velocity);
  // Conjugate gradients for change_, from residual_ = right_ - (M - dt D) change_, with the inverse masses as
  // preconditioner.
  void solve_for_change(double dt);

  Stepper& stepper_;
  const PrescribedMotion& held_;
  std::vector<Vec3> change_;                                         // x of the last step [m/s]
  std::vector<Vec3> before_, right_, residual_, direction_, image_;  // kept from step to step
  State probe_;
  int most_;
  std::uint64_t iterations_ = 0;
  double seconds_ = 0;
};

}  // namespace flexel::simulate
