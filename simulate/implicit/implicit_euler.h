// Implicit Euler for stiff bodies: steps that no stability bound limits (docs/theory/time-integration.md).
//
// With M the lumped masses, C the damping at u-, E the energy of the models and of every effect at the end of
// the step, and x~ = u- + dt v-, a step is the least of the incremental potential
//     1/2 |u - x~|^2_M / dt^2 + 1/2 |u - u-|^2_C / dt + E(u),      v = (u - u-) / dt
// (Kane, Marsden, Ortiz, West 2000, section 3; Martin, Thomaszewski, Grinspun, Gross 2011, section 3.3),
// found by Newton's method with every cell the right way round. Contact is a part of E, its friction a potential of the
// motion since u- (simulate/contact/implicit_contact.h); what that takes for fixed is taken anew from the least,
// which is found again until it suits. First order in the step; it takes energy from
// what swings faster than the step resolves, and the books tell how much.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "simulate/equilibrium/mechanics.h"
#include "simulate/equilibrium/newton.h"

namespace flexel::simulate {

// What one advance did.
struct ImplicitStep {
  double step = 0;  // s it went; 0: Newton's method failed for every length that was tried
  int newton_iterations = 0, cg_iterations = 0;
  int failures = 0;     // of Newton's method, each at another length
  std::string trouble;  // of the last one
};

class ImplicitEuler {
 public:
  // Refers to `problem`, `effects`, `plan` and `mass` [kg] (elements) while it lives. `tolerance`: of Newton's residual,
  // relative to the forces.
  ImplicitEuler(const Problem& problem, const std::vector<ActiveEffect>& effects, const KernelEffects& plan,
                const std::vector<double>& mass, double tolerance);
  ImplicitEuler(const ImplicitEuler&) = delete;
  ImplicitEuler& operator=(const ImplicitEuler&) = delete;

  // Advances `state` to the time `end` [s], or where Newton's method fails part of the way there: a half, a
  // quarter ... of it, but no less than 1/1024 of `whole` [s], and later steps grow back; or as far as effects
  // bear, but no less than half of that. On failure `state` is untouched. finish() has to follow. `progress` hears of
  // every iteration and may throw.
  ImplicitStep advance(State& state, double end, double whole,
                       const std::function<void(const std::string&)>& progress);

  // The advance and its books are done: what effects remember of it.
  void finish(const State& state);
  // The next step makes its tangent anew, so that it depends on the state and reach() alone.
  void forget() { memory_ = {}; }
  // The longest step [s] that is tried next; infinity unless one failed.
  [[nodiscard]] double reach() const { return reach_; }
  void set_reach(double reach) { reach_ = reach; }

  // Of the last advance, (elements): m; N of the damping; N of the supports on prescribed components.
  [[nodiscard]] const std::vector<Vec3>& moved() const { return moved_; }
  [[nodiscard]] std::vector<Vec3> damping_force() const;
  [[nodiscard]] const std::vector<Vec3>& supports() const { return supports_; }
  // As another run's last advance left them.
  void set_supports(std::vector<Vec3> supports) { supports_ = std::move(supports); }
  // J, what the method itself took: 1/2 |v - v-|^2_M, and what the energy E, elastic and potential, fell short of its
  // work, E- - E + grad E(u) . (u - u-). `state`: after the advance.
  [[nodiscard]] double numerical_dissipation(const State& state);
  // Adds the forces of effect p of the constructor's [N] as the advance took them. `state`: after it.
  void add_forces(std::size_t effect, const State& state, std::vector<Vec3>& forces) const;
  // Adds the time that each effect took within advance() to `effects`, those of the constructor; the sum.
  double add_seconds(const std::vector<ActiveEffect>& effects) const;

 private:
  class EffectOfStep;
  class Inertia;
  class StepDamping;
  [[nodiscard]] std::vector<ActiveEffect> all_effects();
  void make_mechanics();
  [[nodiscard]] StiffnessStorage storage() const;
  void set_inertia();
  [[nodiscard]] bool covers_couples() const;
  std::optional<double> begin(const State& state, double end, double shortest);
  void aim(const State& state, double end);
  bool attempt(State& state, const std::function<void(const std::string&)>& progress, ImplicitStep& told);
  bool solve(State& trial, NewtonSteps steps, const std::function<void(const std::string&)>& progress,
             ImplicitStep& told);
  [[nodiscard]] bool settles(const State& found) const;
  [[nodiscard]] double force_scale() const;
  [[nodiscard]] State along_the_way(const State& trial) const;

  const Problem& problem_;
  const std::vector<ActiveEffect>& effects_;
  const std::vector<double>& mass_;
  const std::vector<double>& tau_;  // (parts) s
  double tolerance_;
  bool damped_ = false, touches_ = false;  // by damping and contact
  double step_ = 0, reach_;                // s
  double inertia_of_ = 0;                  // s, the step that the tangent's inertia is of
  State before_;                           // at the start of the step
  std::vector<Vec3> target_;               // x~, displacements without forces [m]
  State aimed_;                            // those, with what is led where it will be
  BlockMatrix damping_matrix_;             // at before_; empty without damping
  std::optional<Mechanics> mechanics_;     // refers to the above
  std::vector<CoupledElements> coupled_;   // in it, by effects, ascending
  std::vector<double> seconds_;            // (effects_) within those before
  NewtonMemory memory_;
  std::vector<Vec3> moved_, supports_;
};

}  // namespace flexel::simulate
