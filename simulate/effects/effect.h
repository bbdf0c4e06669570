// What an effect is, and how a run holds those that its scene calls for.
//
// An effect E is one header (with its .cpp) in simulate/effects and one entry of simulate/scene/effects.h. It
// owns
//   E::Parameters                      what a scene says of it; default: nothing
//   E::name                            what it is called in --explain
//   static void parse(TableReader& scene, Parameters&)
//                                      reads its own keys of the scene
//   static std::optional<E> make(const Parameters&, const Problem&)
//                                      nothing when the scene does not call for it
//   std::string why() const            "2 [[load]]", for --explain
// and any of these hooks, found by concept; a hook that an effect lacks is never called:
//   double energy(const State&) const                                 J
//   void add_forces(const State&, std::vector<Vec3>&) const           N, minus the energy's derivative
//   void add_stiffness(const State&, BlockMatrix&) const              N/m, minus the forces' derivative
//   void constrain(Constraints&) const                                elements that follow a path exactly
//   std::vector<CoupledElements> couples() const                      elements between which its forces act;
//                                                                     they are inner ones then, and hold
//                                                                     nothing
//   void report(const State&, const std::vector<Vec3>& unbalanced, SimulateResult&) const
// In timed runs (simulate/time/timed_run.h) also
//   static constexpr bool needs_time, or bool needs_time() const      true: refused at equilibrium
//   static constexpr Book book                                        where its energy is entered; default:
//                                                                     work
//   void compose(KernelEffects&) const                                     what it asks of the hot kernel
//   void start(State&) const                                          changes the state before the first step
//   double resistance(const State&) const                             W, minus whose derivative by the
//                                                                     velocities its forces are: it resists
//                                                                     them
//   void add_resistance(const State&, double scale, BlockMatrix&) const
//                                                                     scale [1/s] times at least the second
//                                                                     derivative, for implicit steps
//   bool constant() const                                             its forces are the same at every step
//   double added_frequency([const State&,] const std::vector<double>& mass) const
//                                                                     1/s^2: bound on what its stiffness adds
//                                                                     to the square of the largest frequency;
//                                                                     asked anew at every check of the step
//   void begin(const State&) const                                    at the beginning of every act, after
//                                                                     start()
//   bool needs_step_recheck(const State&) const                              asked before every step: it has to be
//                                                                     chosen anew now
//   void finish_step(State&, const StepDone&) const                   after every step, once
//   void add_support_forces(std::vector<Vec3>&) const                 N, of supports in the last step
//   std::vector<double> memory() const, void restore(const std::vector<double>&) const
//                                                                     what goes on from step to step, for
//                                                                     checkpoints
//   std::vector<double> transfer_state() const, void restore_from(const std::vector<double>&) const
//                                                                     likewise, from an act to the next,
//                                                                     whose body an event has changed
//   std::vector<std::string> history_columns() const,
//   std::vector<double> history_values(const State&, const std::vector<Vec3>& unbalanced) const
//                                                                     of the last step and the state it began
//                                                                     with, for the books
//   double injected_energy(const State&) const                                 J, what has come into what it stores
//                                                                     since it was asked last, but for the
//                                                                     work of its forces; the books ask
//                                                                     before every step and have it as work
//                                                                     of
//   static constexpr const char* injected_by
// and, where its forces are entered in two books,
//   std::optional<F> companion() const                                another effect that runs after it
// An effect that a scene does not name makes no object, no array and no pass.
#pragma once
#include <chrono>
#include <concepts>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulate/conditions/constraints.h"
#include "simulate/conditions/kernel_effects.h"
#include "simulate/input/scene_table.h"
#include "simulate/models/stiffness.h"
#include "simulate/result/result.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// Where the energy that an effect's forces give or take is entered: as potential energy (its energy() is
// that), as potential energy that is the work of its forces step by step (energy() follows that to second
// order in the step; what differs when it is 0 again is entered as numerical), as work done on the body, or
// as energy dissipated.
enum class Book { potential, stored, work, dissipation };

// The step that led to a state.
struct StepDone {
  const std::vector<double>& mass;  // (elements) kg
  double kick = 0, drift = 0;       // s, for which forces changed velocities, and these places
};

template <class E>
concept HasEnergy = requires(const E& e, const State& s) {
  { e.energy(s) } -> std::convertible_to<double>;
};
template <class E>
concept AddsForces = requires(const E& e, const State& s, std::vector<Vec3>& f) {
  e.add_forces(s, f);
};
template <class E>
concept AddsStiffness = requires(const E& e, const State& s, BlockMatrix& m) {
  e.add_stiffness(s, m);
};
template <class E>
concept Constrains = requires(const E& e, Constraints& c) {
  e.constrain(c);
};
template <class E>
concept Couples = requires(const E& e) {
  { e.couples() } -> std::same_as<std::vector<CoupledElements>>;
};
template <class E>
concept Reports = requires(const E& e, const State& s, const std::vector<Vec3>& u, SimulateResult& r) {
  e.report(s, u, r);
};

template <class E>
concept Composes = requires(const E& e, KernelEffects& p) {
  e.compose(p);
};
template <class E>
concept Starts = requires(const E& e, State& s) {
  e.start(s);
};
template <class E>
concept Resists = requires(const E& e, const State& s, double scale, BlockMatrix& m) {
  { e.resistance(s) } -> std::convertible_to<double>;
  e.add_resistance(s, scale, m);
};
template <class E>
concept TellsConstant = requires(const E& e) {
  { e.constant() } -> std::same_as<bool>;
};
template <class E>
concept AddsFrequency = requires(const E& e, const std::vector<double>& m) {
  { e.added_frequency(m) } -> std::same_as<double>;
};

template <class E>
concept AddsFrequencyOfState = requires(const E& e, const State& s, const std::vector<double>& m) {
  { e.added_frequency(s, m) } -> std::same_as<double>;
};
template <class E>
concept NeedsStepRecheck = requires(const E& e, const State& s) {
  { e.needs_step_recheck(s) } -> std::same_as<bool>;
};
template <class E>
concept FinishesStep = requires(const E& e, State& s, const StepDone& d) {
  e.finish_step(s, d);
};
template <class E>
concept Begins = requires(const E& e, const State& s) {
  e.begin(s);
};
template <class E>
concept Supports = requires(const E& e, std::vector<Vec3>& f) {
  e.add_support_forces(f);
};
template <class E>
concept Remembers = requires(const E& e, const std::vector<double>& m) {
  { e.memory() } -> std::same_as<std::vector<double>>;
  e.restore(m);
};
template <class E>
concept HandsOver = requires(const E& e, const std::vector<double>& m) {
  { e.transfer_state() } -> std::same_as<std::vector<double>>;
  e.restore_from(m);
};
template <class E>
concept TellsHistory = requires(const E& e, const State& s, const std::vector<Vec3>& u) {
  { e.history_columns() } -> std::same_as<std::vector<std::string>>;
  { e.history_values(s, u) } -> std::same_as<std::vector<double>>;
};
template <class E>
concept PutsIn = requires(const E& e, const State& s) {
  { e.injected_energy(s) } -> std::same_as<double>;
  { E::injected_by } -> std::convertible_to<const char*>;
};
template <class E>
concept TellsNeedOfTime = requires(const E& e) {
  { e.needs_time() } -> std::same_as<bool>;
};

// An effect in a run, its hooks as callables (empty where it has none), and the time it took.
struct Pass {
  std::string name, why;
  std::function<double(const State&)> energy;
  std::function<void(const State&, std::vector<Vec3>&)> add_forces;
  std::function<void(const State&, BlockMatrix&)> add_stiffness;
  std::function<void(Constraints&)> constrain;
  std::function<void(const State&, const std::vector<Vec3>&, SimulateResult&)> report;
  std::vector<CoupledElements> couples;
  std::function<void(KernelEffects&)> compose;
  std::function<void(State&)> start;
  std::function<double(const State&)> resistance;
  std::function<void(const State&, double, BlockMatrix&)> add_resistance;
  std::function<double(const State&, const std::vector<double>&)> added_frequency;
  std::function<bool(const State&)> needs_step_recheck;
  std::function<void(State&, const StepDone&)> finish_step;
  std::function<void(const State&)> begin;
  std::function<void(std::vector<Vec3>&)> add_support_forces;
  std::function<std::vector<double>()> memory;
  std::function<void(const std::vector<double>&)> restore;
  std::function<std::vector<double>()> transfer_state;
  std::function<void(const std::vector<double>&)> restore_from;
  std::vector<std::string> history_columns;
  std::function<std::vector<double>(const State&, const std::vector<Vec3>&)> history_values;
  std::function<double(const State&)> injected_energy;
  const char* injected_by = "";
  Book book = Book::work;
  bool constant = false, needs_time = false;
  double seconds = 0;
};

template <class E>
[[nodiscard]] Pass make_pass(E made) {
  const auto effect = std::make_shared<const E>(std::move(made));
  Pass pass;
  pass.name = E::name;
  pass.why = effect->why();
  if constexpr (HasEnergy<E>) pass.energy = [effect](const State& s) { return effect->energy(s); };
  if constexpr (AddsForces<E>)
    pass.add_forces = [effect](const State& s, std::vector<Vec3>& f) { effect->add_forces(s, f); };
  if constexpr (AddsStiffness<E>)
    pass.add_stiffness = [effect](const State& s, BlockMatrix& m) { effect->add_stiffness(s, m); };
  if constexpr (Constrains<E>) pass.constrain = [effect](Constraints& c) { effect->constrain(c); };
  if constexpr (Couples<E>) pass.couples = effect->couples();
  if constexpr (Composes<E>) pass.compose = [effect](KernelEffects& p) { effect->compose(p); };
  if constexpr (Starts<E>) pass.start = [effect](State& s) { effect->start(s); };
  if constexpr (Resists<E>) {
    pass.resistance = [effect](const State& s) { return effect->resistance(s); };
    pass.add_resistance = [effect](const State& s, double scale, BlockMatrix& m) {
      effect->add_resistance(s, scale, m);
    };
  }
  if constexpr (AddsFrequency<E>)
    pass.added_frequency = [effect, known = std::optional<double>()](const State&,
                                                                     const std::vector<double>& m) mutable {
      if (!known) known = effect->added_frequency(m);
      return *known;
    };
  if constexpr (AddsFrequencyOfState<E>)
    pass.added_frequency = [effect](const State& s, const std::vector<double>& m) {
      return effect->added_frequency(s, m);
    };
  if constexpr (NeedsStepRecheck<E>)
    pass.needs_step_recheck = [effect](const State& s) { return effect->needs_step_recheck(s); };
  if constexpr (FinishesStep<E>)
    pass.finish_step = [effect](State& s, const StepDone& d) { effect->finish_step(s, d); };
  if constexpr (Begins<E>) pass.begin = [effect](const State& s) { effect->begin(s); };
  if constexpr (Supports<E>)
    pass.add_support_forces = [effect](std::vector<Vec3>& f) { effect->add_support_forces(f); };
  if constexpr (Remembers<E>) {
    pass.memory = [effect] { return effect->memory(); };
    pass.restore = [effect](const std::vector<double>& m) { effect->restore(m); };
  }
  if constexpr (HandsOver<E>) {
    pass.transfer_state = [effect] { return effect->transfer_state(); };
    pass.restore_from = [effect](const std::vector<double>& m) { effect->restore_from(m); };
  }
  if constexpr (TellsHistory<E>) {
    pass.history_columns = effect->history_columns();
    pass.history_values = [effect](const State& s, const std::vector<Vec3>& u) {
      return effect->history_values(s, u);
    };
  }
  if constexpr (PutsIn<E>) {
    pass.injected_energy = [effect](const State& s) { return effect->injected_energy(s); };
    pass.injected_by = E::injected_by;
  }
  if constexpr (TellsConstant<E>) pass.constant = effect->constant();
  if constexpr (requires { E::book; }) pass.book = E::book;
  if constexpr (TellsNeedOfTime<E>)
    pass.needs_time = effect->needs_time();
  else if constexpr (requires { E::needs_time; })
    pass.needs_time = E::needs_time;
  if constexpr (Reports<E>)
    pass.report = [effect](const State& s, const std::vector<Vec3>& u, SimulateResult& r) {
      effect->report(s, u, r);
    };
  return pass;
}

// Adds the time of its scope to a pass.
class PassTimer {
 public:
  explicit PassTimer(double& seconds) : seconds_(seconds), began_(std::chrono::steady_clock::now()) {}
  ~PassTimer() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  }
  PassTimer(const PassTimer&) = delete;
  PassTimer& operator=(const PassTimer&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace flexel::simulate
