// The books of a timed run, a row per sample: energies, momenta, probes (docs/motion.md gives every column).
//
// At the time of step n, with the velocities of the half steps before and after it, the kinetic energy is 1/2
// sum m v(n-1/2) . v(n+1/2). It changes from step to step by exactly the mean of the forces at both ends
// times the displacement between, and so the work of every force is summed up; elastic and potential energy
// follow to second order in the step, exactly where they are quadratic. Momentum and angular momentum use the
// mean velocity.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "simulate/cells.h"
#include "simulate/effects/effect.h"
#include "simulate/paper_model.h"
#include "simulate/probes.h"
#include "simulate/time/stepper.h"

namespace flexel {

// J, at one time
struct Energies {
  double kinetic = 0, elastic = 0, potential = 0, work = 0, dissipated = 0;
  // What is missing: kinetic + elastic + potential + dissipated - work, less its value at the start.
  double residual = 0;
};

class History {
 public:
  // Refers to all of them while it lives. `paper`: of the centre-placed parts; null: there are none.
  History(const Setting& setting, const std::vector<Pass>& passes, const std::vector<ProbePoints>& probes,
          const std::vector<double>& mass, const PaperModel* paper, const StepPlan& plan);

  // Before a step: keeps the velocities and, where `sample`, the energies of the state.
  void before(const State& state, bool sample);
  // The forces of pass p [N] (elements) at the state before the step.
  [[nodiscard]] std::vector<Vec3>& forces_of(std::size_t pass) { return forces_[pass]; }
  // Likewise of the damping of connections.
  [[nodiscard]] std::vector<Vec3>& connection_damping() { return connection_damping_; }
  // After it: what the stepper says of its energies, the forces of damping and supports [N] (elements; or
  // none), the length [s] of the step before it (0 for the first), and its own.
  void after(const State& state, const StepOutcome& outcome, const std::vector<Vec3>& damping,
             const std::vector<Vec3>& supports, double previous_step, double step);

  [[nodiscard]] const Energies& last() const { return last_; }             // of the last sample
  [[nodiscard]] double worst_residual() const { return worst_residual_; }  // J, largest absolute one
  [[nodiscard]] double largest_term() const { return largest_term_; }      // J, of any energy
  [[nodiscard]] const std::string& csv() const { return csv_; }

 private:
  void add_row(const State& state);

  const Setting& setting_;
  const std::vector<Pass>& passes_;
  const std::vector<ProbePoints>& probes_;
  const std::vector<double>& mass_;
  const PaperModel* paper_;
  Stencil no_stencil_;
  Cells cells_;
  std::vector<std::vector<Vec3>> forces_;  // (passes x elements)
  std::vector<Vec3> connection_damping_;   // (elements) or empty
  std::vector<Vec3> velocity_;             // before the step
  // (passes, then supports, damping, and where the plan has them plasticity and fracture) J so far
  std::vector<double> energy_;
  std::size_t plasticity_ = 0, fracture_ = 0;  // places in energy_; 0: absent
  bool sample_ = false, first_ = true;
  double time_ = 0, elastic_ = 0, potential_ = 0, start_ = 0;
  Vec3 arm_momentum_ = Vec3::Zero();
  State sampled_;
  Energies last_;
  double worst_residual_ = 0, largest_term_ = 0;
  std::string csv_;
};

}  // namespace flexel
