// A stretch of a timed run in which nothing changes but the state: what is made of a body and a scene to step
// it (effects, kernel, held elements, the bound on the step). A run is one act, or several where something
// else changes between them; the clock and the books go from one act to the next.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "simulate/events/event.h"
#include "simulate/events/fused.h"
#include "simulate/implicit/implicit_euler.h"
#include "simulate/paper/connection_yield.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/stepping/explicit_barrier.h"
#include "simulate/stepping/prescribed_motion.h"
#include "simulate/stepping/staged_damping.h"
#include "simulate/stepping/step_bound.h"
#include "simulate/stepping/stepper.h"
#include "simulate/time/energy_history.h"

namespace flexel::simulate {

// How far a run has come; State::time is the time itself.
struct Clock {
  double until = 0;               // s, when the act ends
  double step = 0, previous = 0;  // s: the present length of a step, that of the last step taken
  double epoch = 0;               // s, time of step 0 of the present length
  std::uint64_t in_epoch = 0;     // steps of the present length
  std::uint64_t steps = 0;        // of the run
  double damping_rate = 0;        // 1/s, of StagedDamping
};

// What an act begins with, beside the body and the state.
struct SegmentStart {
  // The run begins: effects that change the state at its start do, and held elements are put on their paths.
  bool fresh = true;
  std::vector<Vec3> settled = {};      // Problem::settled
  std::vector<FusedPoint> fused = {};  // by events so far
  // What effects hand over, by their names, across an event.
  std::vector<std::pair<std::string, std::vector<double>>> transferred_states = {};
};

// The problem of a timed run with the body as it is now.
[[nodiscard]] Problem timed_problem(const Body& body, const Scene& scene, const SegmentStart& beginning);

class TimeSegment {
 public:
  // Refers to the others while it lives. Throws InputError.
  TimeSegment(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress,
              const SegmentStart& beginning, State state);
  TimeSegment(const TimeSegment&) = delete;
  TimeSegment& operator=(const TimeSegment&) = delete;

  // Chooses the length of the steps from here to clock.until. Throws DivergedError: it has fallen to nothing;
  // InputError: at the first step, where the scene's step is above the stable one.
  void choose_step(Clock& clock);
  // Looks at the present state for choose_step(), which does so itself. Throws InputError: what has joined
  // overlaps.
  void look();
  // Likewise. Throws DivergedError: it is folded, not finite or far beyond what any scene
  // means.
  void refuse_unsound();
  // Chooses anew where the length does not suit what was last looked at.
  void adapt_step(Clock& clock);
  // Before every step: the rates of damping in stages where cells have stretched since the last look.
  void renew_damping(Clock& clock);
  // Whether an effect cannot wait for the next look.
  [[nodiscard]] bool needs_step_recheck() const;
  // Whether cells may change much within `steps`: something goes by a quarter of the smallest spacing or more.
  [[nodiscard]] bool is_fast(const Clock& clock, int steps) const;
  // One step. With `history` its books, and a row of them where `row`. Throws DivergedError.
  void step(Clock& clock, EnergyHistory* history, bool row);
  // What the next steps depend on besides state() and the clock; only where renews() says so.
  struct Memory {
    Stepper::Memory cells;
    ConnectionMemory connections;
    double reach = 0;                          // s, of ImplicitEuler
    std::vector<Vec3> supports;                // N, of its last step
    std::vector<std::vector<double>> effects;  // what each remembers
  };
  [[nodiscard]] Memory memory() const;
  // Throws InputError("", ...): it is that of another act.
  void restore(const Memory& memory);
  // Whether the step to come depends on nothing else. Always, but implicit steps keep their tangent for a
  // while.
  [[nodiscard]] bool renews(const Clock& clock) const;
  // Implicit steps tell `hear` of every iteration; it may throw.
  void set_hear(std::function<void(const std::string&)> hear) { hear_ = std::move(hear); }

  // Multiplies all velocities, but of what follows a path.
  void slow(double factor);
  // Between two steps.
  void change_velocities(const std::function<void(State&)>& change);
  // Loads and reactions, as of the last step.
  void tell_forces(SimulateResult& result) const { tell_forces(result, state_); }
  // Whether kick() can: velocities are those of half steps, and nothing but forces changes them.
  [[nodiscard]] bool kicks() const;
  // The velocities change by the forces of the present state for so many seconds, before or after it.
  void kick(double time);

  // The books of the present state need the forces there, hence a step that is thrown away.
  void close_books(const Clock& clock, EnergyHistory& history);
  // Where no step has led to the present state since an event: likewise what tell_forces() tells, and with `history`
  // the books. Throws DivergedError.
  void tell_forces_ahead(const Clock& clock, EnergyHistory* history, SimulateResult& result);

  // Says what the steps to clock.until do, and the events of the run.
  void explain(const Clock& clock) const;
  [[nodiscard]] std::vector<std::pair<std::string, std::vector<double>>> transferred_states() const;

  // Moves the body to `state`: positions, velocities, what broke, what the cells remember.
  void store(const State& state);
  // Frees the masses (Stepper::drop_mass) where no effect asks for them; neither may the caller then.
  void spare_mass();
  // Frees what the next store() makes anew: positions and velocities of the body.
  void unload();
  // Adds the time of everything that acted, and the iterations, to `result`; once. `explained`: the time of
  // the effects in the hot loop apart from that of the model, which takes some steps more to tell.
  void add_effort(SimulateResult& result, bool explained);
  // What can be measured now but forces, with the stresses where they are asked for.
  void report(const Clock& clock, bool stress, SimulateResult& result);

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const Problem& problem() const { return problem_; }
  // (parts) what touches them, or may within `ahead` s; not before choose_step().
  [[nodiscard]] std::vector<PartTouch> touches(double ahead);
  // J, in effects that store what their forces do.
  [[nodiscard]] double stored();
  [[nodiscard]] const std::vector<ActiveEffect>& effects() const { return effects_; }
  [[nodiscard]] const Stepper& stepper() const { return *stepper_; }
  [[nodiscard]] bool damps() const;  // internally
  [[nodiscard]] const Constraints& constraints() const { return constraints_; }
  // m, how far what follows a path is off it at most: what an event put there.
  [[nodiscard]] double farthest_off_path() const { return held_->farthest_off_path(state_); }
  void put_on_path() { held_->put_on_path(state_); }
  [[nodiscard]] bool is_implicit() const { return euler_.has_value(); }
  // What was fused before it and has not broken.
  [[nodiscard]] std::vector<FusedPoint> fused() const { return joined_ ? joined_->left() : fused_; }
  [[nodiscard]] std::unique_ptr<EnergyHistory> make_history(EnergyBalance balance) const;

 private:
  void choose_step_as_seen(Clock& clock);  // without the look at the state
  class ModelTimer;
  void configure_kernel();
  void add_fused();
  void begin_effects(const SegmentStart& beginning);
  void store_stuck();
  [[nodiscard]] double effect_seconds() const;
  void make_forces();
  void make_implicit();
  void refuse_held_rigid() const;
  void step_implicitly(Clock& clock, EnergyHistory* history, bool row);
  void enter_implicit_step(EnergyHistory& history);
  void tell_forces(SimulateResult& result, const State& state) const;
  void step_and_take_back(const Clock& clock, EnergyHistory* history,
                          const std::function<void(const State&)>& tell);
  void tell_loop_apart();
  template <class Add>
  void add_apart(std::vector<Vec3>* own, const Add& add);
  // Forces of the effects at the present state; none: empty. With a history also one by one.
  [[nodiscard]] const std::vector<Vec3>& sum_forces(EnergyHistory* history);
  void add_connection_forces(EnergyHistory* history);
  // Breaks and lets flow what passes its limits in the present state.
  ConnectionLosses yield_connections();
  [[nodiscard]] bool damps_connections() const;
  [[nodiscard]] bool fits_connections(const ConnectionMemory& memory) const;

  Body& body_;
  const Scene& scene_;
  Progress& progress_;
  Problem problem_;
  std::vector<FusedPoint> fused_;
  std::vector<ProbePoints> probes_;
  std::vector<ActiveEffect> effects_;
  FusedPoints* joined_ = nullptr;  // in effects_; null: nothing is fused
  KernelEffects plan_;
  Constraints constraints_;
  State state_;
  std::optional<PaperModel> paper_;       // of the centre-placed parts
  std::optional<ConnectionYield> yield_;  // where they flow or break
  std::optional<Stepper> stepper_;
  std::optional<PrescribedMotion> held_;
  std::optional<StagedDamping> staged_;
  std::optional<ImplicitEuler> euler_;
  std::function<void(const std::string&)> hear_ = [](const std::string&) {};
  std::optional<StepBound> bound_;
  std::optional<ExplicitBarrier> guard_;  // of explicit steps of model `cells`
  std::vector<Vec3> steady_, outer_;      // (elements) N, of the effects that are constant; of all
  bool varies_ = false;
  double kernel_seconds_ = 0, check_seconds_ = 0, paper_seconds_ = 0;  // steps; bounds on them
  int newton_iterations_ = 0, cg_iterations_ = 0;
};

}  // namespace flexel::simulate
