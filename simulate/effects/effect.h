// What an effect is, and how a run holds those that its scene calls for (docs/measurements/effects.md).
//
// An effect is a class E derived from Effect, in one header (with its .cpp) in simulate/effects, and one row
// of simulate/scene/effects.cpp. Beside what it overrides it has
//   E::Parameters                      what a scene says of it; default: nothing
//   E::name                            what it is called in --explain
//   static void parse(TableReader& scene, Parameters&)
//                                      reads its own keys of the scene
//   static std::optional<E> make(const Parameters&, const Problem&)
//                                      nothing when the scene does not call for it
// An effect that a scene does not name makes no object and no array. Effects are added up in the order of
// their rows, which decides the last bits of the sums and nothing else.
#pragma once
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulate/conditions/constraints.h"
#include "simulate/conditions/kernel_effects.h"
#include "simulate/conditions/part_touch.h"
#include "simulate/input/scene_table.h"
#include "simulate/models/stiffness.h"
#include "simulate/result/result.h"
#include "simulate/rigid/rigid_body.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

class PaperModel;

// Where the energy that an effect's forces give or take is entered: nowhere, for it adds no forces; as
// potential energy (its energy() is that); as potential energy that is the work of its forces step by step
// (energy() follows that to second order in the step; what differs when it is 0 again is entered as
// numerical); as work done on the body; or as energy dissipated.
enum class EnergyAccount { none, potential, stored, work, dissipation };

// Where an effect acts: at equilibrium alone (its make() refuses other runs); everywhere; in timed runs and in the
// dynamic relaxation that looks for equilibrium with contact; in timed runs alone. Each is more than the one before.
enum class ActsIn { equilibrium, all, relaxation_and_time, time };

// J, that has come into what an effect stores, but for the work of its forces: from an account of that name.
struct EnergyTransfer {
  const char* from = "";
  EnergyAccount kind = EnergyAccount::work;
  double energy = 0;
};

// W, of the account of that name, by what acts on no element.
struct EffectPower {
  const char* account = "";
  EnergyAccount kind = EnergyAccount::work;
  double power = 0;
};

// What an effect makes of a step that is to be taken.
struct StepBearing {
  double share = 1;        // of it, that may be taken at once
  bool recouples = false;  // couples() has changed
};

// The step that led to a state.
struct StepDone {
  const std::vector<double>& mass;  // (elements) kg; empty unless an effect needs_mass()
  double kick = 0, drift = 0;       // s, for which forces changed velocities, and these places
};

// Hooks are called where the run needs them; each default does nothing.
class Effect {
 public:
  virtual ~Effect() = default;

  [[nodiscard]] virtual std::string why() const = 0;  // "2 [[load]]", for --explain

  // --- what it is ---
  [[nodiscard]] virtual EnergyAccount account() const { return EnergyAccount::none; }
  // It moves a body that is at rest.
  [[nodiscard]] virtual bool drives() const { return false; }
  // What the scene asks of it has no meaning at rest, though the effect has.
  [[nodiscard]] virtual bool needs_time() const { return false; }
  // Its forces are the same at every step.
  [[nodiscard]] virtual bool constant() const { return false; }
  // It has an add_stiffness(), at the elements that add_forces() pulls at.
  [[nodiscard]] virtual bool adds_stiffness() const { return false; }
  // Its forces follow the shape and have no energy: add_force_change() tells how, which is not symmetric.
  [[nodiscard]] virtual bool follows() const { return false; }
  // Its forces are minus the derivative of resistance() by the velocities.
  [[nodiscard]] virtual bool resists() const { return false; }
  // Its finish_step() changes the state or remembers it.
  [[nodiscard]] virtual bool finishes_steps() const { return false; }
  // added_frequency() or finish_step() reads the masses.
  [[nodiscard]] virtual bool needs_mass() const { return false; }
  // Its forces set in where surfaces touch. So at equilibrium it holds nothing, what it does is in proportion to
  // nothing, and full Newton steps may go to and fro.
  [[nodiscard]] virtual bool unilateral() const { return false; }
  // Elements between which its forces act; they are inner forces then, and hold nothing.
  [[nodiscard]] virtual std::vector<CoupledElements> couples() const { return {}; }

  // --- mechanics ---
  [[nodiscard]] virtual double energy(const State&) { return 0; }  // J
  // Whether its forces may be other than 0 in this state; asked right before add_forces().
  [[nodiscard]] virtual bool acts(const State&) { return true; }
  // N, minus the energy's derivative.
  virtual void add_forces(const State&, std::vector<Vec3>& /*forces*/) {}
  // N/m, minus the forces' derivative; and as much of it as is positive semi-definite, where it may not be.
  virtual void add_stiffness(const State&, BlockMatrix&) {}
  virtual void add_positive_stiffness(const State& state, BlockMatrix& matrix) {
    add_stiffness(state, matrix);
  }
  // N, how the forces of an effect that follows() change to first order along a change (elements) m; or
  // that with the derivative transposed (true). Added to the last.
  virtual void add_force_change(const State&, const std::vector<Vec3>&, bool, std::vector<Vec3>&) {}
  // The run has come to this state and goes on from it: the equilibrium of a load step, or the end of a step
  // in time. States that are only tried are not told.
  virtual void accept(const State&) {}
  // Elements that follow a path exactly.
  virtual void constrain(Constraints&) {}
  // What people should know of it in a state that a run begins with or ends in, a line each.
  [[nodiscard]] virtual std::vector<std::string> warnings(const State&) const { return {}; }
  // `unbalanced`: N (elements), on elements that are held.
  virtual void report(const State&, const std::vector<Vec3>& /*unbalanced*/, SimulateResult&) {}

  // --- equilibrium (simulate/equilibrium/equilibrium.h) ---
  // Elements that add_stiffness() may add to in some state, though add_forces() does not pull at them in most.
  [[nodiscard]] virtual std::vector<std::uint32_t> may_pull_at() const { return {}; }
  // These are all that it adds to now: its forces are not to be tried to find out.
  [[nodiscard]] virtual bool tells_where_it_pulls() const { return false; }
  // Share of the load that one load step may have at most.
  [[nodiscard]] virtual double longest_load_step() const { return 1; }
  // Why a load step did not lead from one equilibrium to the other, though forces balance in both; empty: it did.
  [[nodiscard]] virtual std::string refuses_load_step(const State& /*before*/, const State& /*after*/) const {
    return {};
  }

  // --- timed runs (simulate/time/timed_run.h) ---
  // What it asks of the hot kernel. Then, when all have asked, whether that suffices; throws InputError.
  virtual void configure_kernel(KernelEffects&) const {}
  virtual void check_kernel(const KernelEffects&) const {}
  // What the scene gives every element at the beginning of the run; all effects add theirs before any start().
  virtual void add_initial_state(State&) {}
  // The connections of centre-placed parts, and tau [s] (parts) of their damping; before any step.
  virtual void attach(const PaperModel&, const std::vector<double>& /*damping*/) {}
  // Changes the state before the first step.
  virtual void start(State&) {}
  // At the beginning of every segment, after start(), and when velocities were changed from outside.
  virtual void begin(const State&) {}
  // W, see resists(); and scale [1/s] times at least its second derivative, for implicit steps.
  [[nodiscard]] virtual double resistance(const State&) { return 0; }
  virtual void add_resistance(const State&, double /*scale*/, BlockMatrix&) {}
  // 1/s^2: bound on what its stiffness adds to the square of the largest frequency; asked anew at every check
  // of the step.
  [[nodiscard]] virtual double added_frequency(const State&, const std::vector<double>& /*mass*/) {
    return 0;
  }
  // Asked before every step: whether its length has to be chosen anew now.
  [[nodiscard]] virtual bool needs_step_recheck(const State&) { return false; }
  // s: a step that it learns its bound from, where the scene gives none.
  [[nodiscard]] virtual double first_step() const { return std::numeric_limits<double>::infinity(); }
  virtual void finish_step(State&, const StepDone&) {}
  // Of free rigid parts at the beginning of the last step, between the velocities before and after it;
  // `half_kick`: those before it were of that very time.
  [[nodiscard]] virtual std::vector<RigidMomenta> rigid_momenta(bool /*half_kick*/) const { return {}; }
  // N, of supports in the last step.
  virtual void add_support_forces(std::vector<Vec3>& /*forces*/) {}
  // The share of the hot loop's time that it takes.
  [[nodiscard]] virtual double kernel_share(const KernelShares&) const { return 0; }

  // --- implicit steps (simulate/implicit/implicit_euler.h), in the order of their calls ---
  // What of it they do not take, in words; empty: they take it.
  [[nodiscard]] virtual std::string refuses_implicit_steps() const { return {}; }
  // Elements that finish_step() leads in explicit steps.
  virtual void constrain_implicit_steps(Constraints&) {}
  // Puts those where they are at `time` [s].
  virtual void lead_to(double /*time*/, std::vector<Vec3>& /*displacement*/) {}
  // A step of `step` s begins at `before`; without forces it would end at `aimed`.
  [[nodiscard]] virtual StepBearing begin_implicit_step(const State& /*before*/, const State& /*aimed*/,
                                                        double /*step*/) {
    return {};
  }
  // Newton's method has ended at `found`. False: what it took for fixed is another there, and has been taken
  // from there.
  [[nodiscard]] virtual bool settles(const State& /*found*/) { return true; }
  // The step has led to `state`, and the books have it. `supports`: N (elements), on those that are led.
  virtual void end_implicit_step(const State& /*state*/, const StepDone&,
                                 const std::vector<Vec3>& /*supports*/) {}

  // Enters in `touches` (parts) what touches each part in this state, or may within `ahead` s.
  virtual void add_touches(const State&, double /*ahead*/, std::vector<PartTouch>& /*touches*/) {}

  // What goes on from step to step, for checkpoints.
  [[nodiscard]] virtual std::vector<double> memory() const { return {}; }
  virtual void restore(const std::vector<double>& /*memory*/) {}
  // Likewise from a segment to the next, whose body an event has changed.
  [[nodiscard]] virtual std::vector<double> transfer_state() const { return {}; }
  virtual void restore_from(const std::vector<double>& /*transferred*/) {}

  // Columns of the history, "NAME [UNIT]"; values of the last step and the state it began with.
  [[nodiscard]] virtual std::vector<std::string> history_columns() const { return {}; }
  [[nodiscard]] virtual std::vector<double> history_values(const State&,
                                                           const std::vector<Vec3>& /*unbalanced*/) {
    return {};
  }
  // With the velocities before the last step's forces, or after them.
  [[nodiscard]] virtual std::vector<EffectPower> powers(bool /*after*/) const { return {}; }
  // Since they were asked for last; the energy history does before every step.
  [[nodiscard]] virtual std::vector<EnergyTransfer> take_transfers(const State&) { return {}; }

 protected:
  Effect() = default;
  Effect(const Effect&) = default;
  Effect(Effect&&) = default;
  Effect& operator=(const Effect&) = default;
  Effect& operator=(Effect&&) = default;
};

// Adds the time of its scope.
class ScopeTimer {
 public:
  explicit ScopeTimer(double& seconds) : seconds_(seconds), began_(std::chrono::steady_clock::now()) {}
  ~ScopeTimer() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  }
  ScopeTimer(const ScopeTimer&) = delete;
  ScopeTimer& operator=(const ScopeTimer&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point began_;
};

// An effect in a run. Every call through `->` is timed whole.
class ActiveEffect {
 public:
  ActiveEffect(std::string called, std::unique_ptr<Effect> effect)
      : name(std::move(called)),
        why(effect->why()),
        acts(effect->needs_time() ? ActsIn::time : ActsIn::all),
        couples(effect->couples()),
        effect_(std::move(effect)) {}

  class Call {
   public:
    Call(Effect& effect, double& seconds) : effect_(effect), timer_(seconds) {}
    Effect* operator->() const { return &effect_; }

   private:
    Effect& effect_;
    ScopeTimer timer_;
  };
  [[nodiscard]] Call operator->() const { return {*effect_, seconds}; }
  // For what is timed elsewhere.
  [[nodiscard]] Effect& untimed() const { return *effect_; }

  std::string name, why;
  ActsIn acts = ActsIn::all;
  std::vector<CoupledElements> couples;
  mutable double seconds = 0;  // that its calls took

 private:
  std::unique_ptr<Effect> effect_;
};

template <class E>
[[nodiscard]] ActiveEffect activate(E effect) {
  return {E::name, std::make_unique<E>(std::move(effect))};
}

}  // namespace flexel::simulate
