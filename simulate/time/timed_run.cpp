// The loop over steps. Per step: forces of the effects that change, the kernel, held elements, and where
// asked the books. Every kCheck steps the bound on the step is taken anew and the state kept as the last good
// one.
#include "simulate/time/timed_run.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "formats/body_file.h"
#include "formats/error.h"
#include "formats/files.h"
#include "formats/parallel.h"
#include "formats/program.h"
#include "formats/units.h"
#include "simulate/paper_model.h"
#include "simulate/report.h"
#include "simulate/time/folds.h"
#include "simulate/time/held.h"
#include "simulate/time/history.h"
#include "simulate/time/implicit_damping.h"
#include "simulate/time/series.h"
#include "simulate/time/step_bound.h"
#include "simulate/time/stepper.h"

namespace flexel {
namespace {

constexpr int kCheck = 100;          // steps between checks
constexpr double kSafety = 0.9;      // of the bound: it may fall between two checks
constexpr double kRunaway = 1e4;     // of the body's diagonal: a displacement that no scene means
constexpr std::size_t kRows = 1000;  // of the history, unless the scene says otherwise
constexpr std::size_t kFrames = 50;  // likewise

std::vector<Vec3> initial_velocity(const Body& body) {
  std::vector<Vec3> velocity(body.element_count(), Vec3::Zero());
  if (const auto found = body.element_columns.find("velocity");
      found != body.element_columns.end() && found->second.components == 3)
    for (std::size_t e = 0; e < velocity.size(); ++e)
      velocity[e] =
          Vec3(found->second.values[3 * e], found->second.values[3 * e + 1], found->second.values[3 * e + 2]);
  return velocity;
}

Constraints no_constraints(const Body& body) {
  Constraints constraints;
  constraints.mask.assign(body.element_count(), 0);
  constraints.motion.assign(body.element_count(), {0, 0, 0});
  return constraints;
}

class TimedRun {
 public:
  TimedRun(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress);
  SimulateResult operator()();

 private:
  void look_at_stiffness();
  void choose_step();
  void check();
  void refuse_unsound();
  void step();
  void sum_forces();
  void add_connection_forces();
  void write_frame();
  void store(const State& state);
  [[nodiscard]] std::string save_failed();
  [[noreturn]] void diverged(const std::string& what);
  SimulateResult report();

  Body& body_;
  const Scene& scene_;
  const SimulateOptions& options_;
  Progress& progress_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  double duration_;
  Setting setting_;
  std::vector<ProbePoints> probes_;
  std::vector<Pass> passes_;
  StepPlan plan_;
  Constraints constraints_;
  State state_;
  std::optional<PaperModel> paper_;  // of the centre-placed parts
  bool paper_damped_ = false;
  std::optional<Stepper> stepper_;
  std::optional<Held> held_;
  std::optional<ImplicitDamping> implicit_;
  std::optional<History> history_;
  std::optional<Series> series_;
  std::optional<StepBound> bound_;
  std::vector<Vec3> steady_, outer_;  // (elements) N, of the passes that are constant; of all
  bool varies_ = false;
  State good_;
  double step_ = 0, previous_step_ = 0, epoch_ = 0;  // s; time of step 0 of the present step length
  std::uint64_t in_epoch_ = 0, steps_ = 0;
  double next_row_ = 0, next_frame_ = 0;
  double kernel_seconds_ = 0, paper_seconds_ = 0;
};

TimedRun::TimedRun(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress)
    : body_(body),
      scene_(scene),
      options_(options),
      progress_(progress),
      duration_(*scene.run.time),
      setting_{body,
               materials_of_parts(scene, body),
               std::vector<std::uint8_t>(body.cell_count(), 0),
               models_of_parts(scene, body),
               hooke_of_parts(scene, body),
               std::vector<std::uint8_t>(body.element_count(), 0)},
      constraints_(no_constraints(body)) {
  setting_.duration = duration_;
  probes_ = place_probes(scene, setting_);
  passes_ = Effects::passes(scene.effects, setting_);
  warn_of_springs(setting_, progress_);
  name_materials(body_, setting_.materials);
  plan_.damping.assign(body.parts.size(), 0);
  state_.time = 0;
  state_.displacement.resize(body.element_count());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state_.displacement[e] = body.position[e] - body.rest[e];
  state_.velocity = initial_velocity(body);
  for (Pass& pass : passes_) {
    if (pass.compose) pass.compose(plan_);
    if (pass.start) pass.start(state_);
    if (pass.constrain) pass.constrain(constraints_);
  }
  bound_.emplace(setting_, passes_, plan_);
  // Explicit damping may cut the step by 2; beyond that every step solves for it.
  const bool by_steps = scene.run.method == TimeMethod::explicit_euler || bound_->damps_explicitly();
  stepper_.emplace(setting_, plan_, !options.history.empty() || !by_steps, options.isa);
  stepper_->read_memory(body.cell_columns);
  if (Stepper::remembers(body.cell_columns) && plan_.plasticity.empty() && plan_.fracture.empty())
    progress.warn("the body flowed or broke before: without [plasticity] or [fracture] it forgets that");
  held_.emplace(constraints_, body_, state_);
  if (!by_steps) implicit_.emplace(*stepper_, *held_);
  for (const Pass& pass : passes_) {
    if (!pass.add_forces) continue;
    if (steady_.empty()) steady_.assign(body.element_count(), Vec3::Zero());
    if (pass.constant) pass.add_forces(state_, steady_);
    varies_ = varies_ || !pass.constant;
  }
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    if (body.parts[p].placement != Placement::centre) continue;
    if (!paper_) paper_.emplace(setting_);
    paper_damped_ = paper_damped_ || plan_.damping[p] > 0;
    varies_ = true;
  }
  if (varies_ && steady_.empty()) steady_.assign(body.element_count(), Vec3::Zero());
  if (!options.history.empty())
    history_.emplace(setting_, passes_, probes_, stepper_->mass(), paper_ ? &*paper_ : nullptr, plan_);
  if (!options.series.empty()) series_.emplace(options.series, options.compress);
}

void TimedRun::look_at_stiffness() {
  stepper_->mark_broken(body_.broken);
  bound_->look(state_, paper_ ? &*paper_ : nullptr, stepper_->mass());
}

void TimedRun::choose_step() {
  look_at_stiffness();
  const double longest = bound_->longest(implicit_.has_value());
  double step = kSafety * longest;
  if (scene_.run.step) {
    if (steps_ == 0 && *scene_.run.step > longest)
      throw InputError(scene_.name,
                       fmt::format("[run] step = {:.4g} s is above {:.4g} s, the longest stable one",
                                   *scene_.run.step, longest));
    step = std::min(steps_ == 0 ? longest : step, *scene_.run.step);
  }
  epoch_ = *state_.time;
  in_epoch_ = 0;
  const double left = duration_ - epoch_;
  // without stiffness there is no bound: a thousand steps draw the path
  if (!std::isfinite(step)) step = duration_ / 1000;
  if (!(step > 1e-12 * duration_))
    diverged(fmt::format("the stable step has fallen to {:.3g} s: {}", step,
                         where_it_folds(body_, state_.displacement)));
  step_ = left / std::ceil(left / step - 1e-9);
}

// Stops the run where the present state is folded, not finite or far beyond what any scene means.
void TimedRun::refuse_unsound() {
  double farthest = 0;
  for (const Vec3& u : state_.displacement)
    farthest = u.allFinite() ? std::max(farthest, u.squaredNorm()) : std::numeric_limits<double>::infinity();
  if (!(std::sqrt(farthest) < kRunaway * (1 + body_extent(body_))))
    diverged("the motion ran away: look at loads and units, or give a shorter [run] step");
  look_at_stiffness();
  if (!(bound_->longest(implicit_.has_value()) > 0)) diverged(where_it_folds(body_, state_.displacement));
}

void TimedRun::check() {
  throw_if_interrupted();
  if (options_.timeout &&
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count() > *options_.timeout) {
    good_ = state_;
    throw TimeoutError(fmt::format("stopped by --timeout after {} steps at {:.4g} s of {:.4g} s{}", steps_,
                                   *state_.time, duration_, save_failed()));
  }
  refuse_unsound();
  const double longest = bound_->longest(implicit_.has_value());
  good_ = state_;
  if (step_ > 0.97 * longest || (!scene_.run.step && step_ < 0.6 * kSafety * longest)) choose_step();
  progress_.update(*state_.time / duration_, fmt::format("{:.4g} s, step {}", *state_.time, steps_));
}

// Forces of the passes at the present state; with a history also one by one.
void TimedRun::sum_forces() {
  if (history_)
    for (std::size_t p = 0; p < passes_.size(); ++p)
      if (std::vector<Vec3>& own = history_->forces_of(p); !own.empty()) {
        std::fill(own.begin(), own.end(), Vec3::Zero());
        passes_[p].add_forces(state_, own);
      }
  if (!varies_) return;
  outer_ = steady_;
  for (Pass& pass : passes_)
    if (pass.add_forces && !pass.constant) {
      const PassTimer timer(pass.seconds);
      pass.add_forces(state_, outer_);
    }
  if (paper_) add_connection_forces();
}

void TimedRun::add_connection_forces() {
  const PassTimer timer(paper_seconds_);
  if (const PaperModel::SmallestVolume least = paper_->smallest_volume(state_); !(least.value > 0))
    diverged(folds_at("an element", body_.rest[least.element]));
  paper_->add_forces(state_, outer_);
  if (!paper_damped_) return;
  paper_->add_damping(state_, plan_.damping, outer_);
  if (!history_) return;
  std::vector<Vec3>& own = history_->connection_damping();
  own.assign(body_.element_count(), Vec3::Zero());
  paper_->add_damping(state_, plan_.damping, own);
}

void TimedRun::step() {
  const bool row = history_ && *state_.time >= next_row_;
  if (row) next_row_ += scene_.run.history_every.value_or(duration_ / kRows);
  if (history_) history_->before(state_, row);
  const bool first = steps_ == 0;
  const double before = first ? (scene_.run.method == TimeMethod::verlet ? 0 : step_) : previous_step_;
  const step::Advance advance{0.5 * (before + step_), step_, scene_.run.method == TimeMethod::explicit_euler};
  state_.kick = advance.kick;
  sum_forces();
  StepOutcome outcome;
  const double end = epoch_ + static_cast<double>(in_epoch_ + 1) * step_;
  {
    const PassTimer timer(kernel_seconds_);
    const std::vector<Vec3>& outer = varies_ ? outer_ : steady_;
    outcome = implicit_ ? implicit_->advance(state_, outer, advance, end)
                        : stepper_->advance(state_, outer, advance);
  }
  ++in_epoch_;
  ++steps_;
  state_.time = end;
  held_->impose(state_, stepper_->mass(), advance);
  if (history_) {
    std::vector<Vec3> supports(body_.element_count(), Vec3::Zero());
    held_->add_forces(supports);
    history_->after(state_, outcome, stepper_->damping_force(), supports, first ? 0 : previous_step_, step_);
  }
  previous_step_ = step_;
  if (!(outcome.smallest_jacobian > 0)) diverged(where_it_folds(body_, state_.displacement));
}

void TimedRun::store(const State& state) {
  body_.position.resize(body_.element_count());
  Column velocity;
  velocity.components = 3;
  velocity.values.reserve(3 * body_.element_count());
  for (std::size_t e = 0; e < body_.element_count(); ++e) {
    body_.position[e] = body_.rest[e] + state.displacement[e];
    velocity.values.insert(velocity.values.end(), state.velocity[e].begin(), state.velocity[e].end());
  }
  body_.element_columns["velocity"] = std::move(velocity);
  if (stepper_->mark_broken(body_.broken)) derive_connections(body_);
  stepper_->write_memory(body_.cell_count(), body_.cell_columns);
}

void TimedRun::write_frame() {
  if (!series_) return;
  store(state_);
  series_->add(body_, *state_.time);
  next_frame_ = duration_ * static_cast<double>(series_->size()) / scene_.run.frames.value_or(kFrames);
}

std::string TimedRun::save_failed() {
  if (history_) {
    OutputFile file(options_.history, false);
    file.write(history_->csv());
    file.commit();
  }
  if (options_.failed_output.empty() || good_.displacement.empty()) return "";
  store(good_);
  write_body(body_, options_.failed_output);
  return fmt::format("; the state at {:.6g} s is in {}", *good_.time, options_.failed_output);
}

void TimedRun::diverged(const std::string& what) {
  throw DivergedError(fmt::format("step {} at {:.6g} s: {}{}", steps_, *state_.time, what, save_failed()));
}

SimulateResult TimedRun::report() {
  SimulateResult result;
  std::vector<Vec3> unbalanced(body_.element_count(), Vec3::Zero());
  held_->add_forces(unbalanced);
  for (Vec3& force : unbalanced) force = -force;
  for (const Pass& pass : passes_)
    if (pass.report) pass.report(state_, unbalanced, result);
  for (const ProbePoints& probe : probes_) result.probes.push_back(measure(probe, state_));
  const Stencil none;
  const Cells cells(setting_, none);
  const std::optional<double> inelastic = stepper_->elastic_energy(state_);
  result.elastic_energy =
      (inelastic ? *inelastic : cells.energy(state_)) + (paper_ ? paper_->energy(state_) : 0);
  if (body_.cell_count() > 0) result.smallest_jacobian = cells.smallest_jacobian(state_).value;
  if (paper_)
    result.smallest_jacobian = std::min(result.smallest_jacobian, paper_->smallest_volume(state_).value);
  measure_corners(cells, body_, state_, result, progress_);
  measure_displacement(body_, state_, result);
  for (const double mass : stepper_->mass()) result.mass += mass;
  TimedSummary timed{*state_.time, steps_, step_, stepper_->isa(), {}};
  if (history_) {
    const Energies& last = history_->last();
    timed.books = {{"kinetic", last.kinetic},
                   {"elastic", last.elastic},
                   {"potential", last.potential},
                   {"work", last.work},
                   {"dissipated", last.dissipated},
                   {"worst_residual", history_->worst_residual()},
                   {"largest_term", history_->largest_term()}};
  }
  result.timed = timed;
  result.passes.push_back(
      {"cells", fmt::format("model of every part, kernel {}", stepper_->isa()), kernel_seconds_});
  if (paper_) result.passes.push_back({"connections", "model of centre-placed parts", paper_seconds_});
  for (const Pass& pass : passes_) result.passes.push_back({pass.name, pass.why, pass.seconds});
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  return result;
}

SimulateResult TimedRun::operator()() {
  choose_step();
  if (options_.explain) {
    progress_.say(fmt::format("plan: cells (the parts' models), {} steps of {:.4g} s, kernel {}",
                              static_cast<std::uint64_t>(std::llround(duration_ / step_)), step_,
                              stepper_->isa()));
    if (implicit_)
      progress_.say(
          "plan: every step solves for the damping, which taken explicitly would cut it by more than 2");
    for (const Pass& pass : passes_) progress_.say(fmt::format("plan: {} ({})", pass.name, pass.why));
  }
  write_frame();
  good_ = state_;
  try {
    while (*state_.time < duration_ * (1 - 1e-12)) {
      if (steps_ % kCheck == 0) check();
      step();
      if (series_ && *state_.time >= next_frame_ * (1 - 1e-9)) write_frame();
    }
    refuse_unsound();  // a step looks at the state that it begins with; nothing has looked at the last one
  } catch (const Interrupted&) {
    good_ = state_;
    if (const std::string saved = save_failed(); !saved.empty())
      progress_.say(fmt::format("interrupted at step {}{}", steps_, saved));
    throw;
  }
  if (history_) {  // the books of the last state need the forces there, hence a step that is thrown away
    State last = state_;
    const Stepper::Memory memory = stepper_->memory();
    next_row_ = 0;
    step();
    state_ = std::move(last);
    stepper_->restore(memory);
    --steps_;
    OutputFile file(options_.history, false);
    file.write(history_->csv());
    file.commit();
  }
  store(state_);
  return report();
}

}  // namespace

SimulateResult run_in_time(Body& body, const Scene& scene, const SimulateOptions& options,
                           Progress& progress) {
  return TimedRun(body, scene, options, progress)();
}

}  // namespace flexel
