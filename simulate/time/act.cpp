// Per step: forces of the effects that change, the kernel, held elements, and where asked the books.
#include "simulate/time/act.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "formats/error.h"
#include "simulate/report.h"
#include "simulate/time/folds.h"

namespace flexel {
namespace {

constexpr double kSafety = 0.9;   // of the bound: it may fall between two checks
constexpr double kRunaway = 1e4;  // of the body's diagonal: a displacement that no scene means

Constraints no_constraints(const Body& body) {
  Constraints constraints;
  constraints.mask.assign(body.element_count(), 0);
  constraints.motion.assign(body.element_count(), {0, 0, 0});
  return constraints;
}

}  // namespace

State beginning(const Body& body) {
  State state;
  state.time = 0;
  state.displacement.resize(body.element_count());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e] = body.position[e] - body.rest[e];
  state.velocity.assign(body.element_count(), Vec3::Zero());
  const auto found = body.element_columns.find("velocity");
  if (found == body.element_columns.end() || found->second.components != 3) return state;
  const std::vector<double>& values = found->second.values;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.velocity[e] = Vec3(values[3 * e], values[3 * e + 1], values[3 * e + 2]);
  return state;
}

Act::Act(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress, State state,
         bool fresh)
    : body_(body),
      scene_(scene),
      progress_(progress),
      setting_{body,
               materials_of_parts(scene, body),
               std::vector<std::uint8_t>(body.cell_count(), 0),
               models_of_parts(scene, body),
               hooke_of_parts(scene, body),
               std::vector<std::uint8_t>(body.element_count(), 0),
               scene.run.time},
      probes_(place_probes(scene, setting_)),
      passes_(Effects::passes(scene.effects, setting_)),
      constraints_(no_constraints(body)),
      state_(std::move(state)) {
  if (fresh) warn_of_springs(setting_, progress_);
  name_materials(body_, setting_.materials);
  plan_.damping.assign(body.parts.size(), 0);
  for (Pass& pass : passes_) {
    if (pass.compose) pass.compose(plan_);
    if (pass.start && fresh) pass.start(state_);
    if (pass.constrain) pass.constrain(constraints_);
  }
  bound_.emplace(setting_, passes_, plan_);
  // Explicit damping may cut the step by 2; beyond that every step solves for it.
  const bool by_steps = scene.run.method == TimeMethod::explicit_euler || bound_->damps_explicitly();
  stepper_.emplace(setting_, plan_, !options.history.empty() || !by_steps, options.isa);
  stepper_->read_memory(body.cell_columns);
  if (fresh && Stepper::remembers(body.cell_columns) && plan_.plasticity.empty() && plan_.fracture.empty())
    progress.warn("the body flowed or broke before: without [plasticity] or [fracture] it forgets that");
  held_.emplace(constraints_, body_, state_, fresh);
  if (!by_steps) implicit_.emplace(*stepper_, *held_);
  make_forces();
}

void Act::make_forces() {
  for (const Pass& pass : passes_) {
    if (!pass.add_forces) continue;
    if (steady_.empty()) steady_.assign(body_.element_count(), Vec3::Zero());
    if (pass.constant) pass.add_forces(state_, steady_);
    varies_ = varies_ || !pass.constant;
  }
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    if (body_.parts[p].placement != Placement::centre) continue;
    if (!paper_) paper_.emplace(setting_);
    paper_damped_ = paper_damped_ || plan_.damping[p] > 0;
    varies_ = true;
  }
  if (varies_ && steady_.empty()) steady_.assign(body_.element_count(), Vec3::Zero());
}

std::unique_ptr<History> Act::make_history(Ledger ledger) const {
  return std::make_unique<History>(setting_, passes_, probes_, stepper_->mass(), paper_ ? &*paper_ : nullptr,
                                   plan_, std::move(ledger));
}

void Act::look() {
  stepper_->mark_broken(body_.broken);
  bound_->look(state_, paper_ ? &*paper_ : nullptr, stepper_->mass());
}

void Act::choose_step(Clock& clock) {
  look();
  const double longest = bound_->longest(implicit_.has_value());
  double step = kSafety * longest;
  if (scene_.run.step) {
    if (clock.steps == 0 && *scene_.run.step > longest)
      throw InputError(scene_.name,
                       fmt::format("[run] step = {:.4g} s is above {:.4g} s, the longest stable one",
                                   *scene_.run.step, longest));
    step = std::min(clock.steps == 0 ? longest : step, *scene_.run.step);
  }
  clock.epoch = *state_.time;
  clock.in_epoch = 0;
  const double left = clock.until - clock.epoch;
  // without stiffness there is no bound: a thousand steps draw the path
  if (!std::isfinite(step)) step = *scene_.run.time / 1000;
  if (!(step > 1e-12 * *scene_.run.time))
    throw DivergedError(fmt::format("the stable step has fallen to {:.3g} s: {}", step,
                                    where_it_folds(body_, state_.displacement)));
  clock.step = left / std::ceil(left / step - 1e-9);
}

void Act::refuse_unsound() {
  double farthest = 0;
  for (const Vec3& u : state_.displacement)
    farthest = u.allFinite() ? std::max(farthest, u.squaredNorm()) : std::numeric_limits<double>::infinity();
  if (!(std::sqrt(farthest) < kRunaway * (1 + body_extent(body_))))
    throw DivergedError("the motion ran away: look at loads and units, or give a shorter [run] step");
  look();
  if (!(bound_->longest(implicit_.has_value()) > 0))
    throw DivergedError(where_it_folds(body_, state_.displacement));
}

void Act::adapt_step(Clock& clock) {
  const double longest = bound_->longest(implicit_.has_value());
  if (clock.step > 0.97 * longest || (!scene_.run.step && clock.step < 0.6 * kSafety * longest))
    choose_step(clock);
}

// Forces of the passes at the present state; with a history also one by one.
void Act::sum_forces(History* history) {
  if (history)
    for (std::size_t p = 0; p < passes_.size(); ++p)
      if (std::vector<Vec3>& own = history->forces_of(p); !own.empty()) {
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
  if (paper_) add_connection_forces(history);
}

void Act::add_connection_forces(History* history) {
  const PassTimer timer(paper_seconds_);
  if (const PaperModel::SmallestVolume least = paper_->smallest_volume(state_); !(least.value > 0))
    throw DivergedError(folds_at("an element", body_.rest[least.element]));
  paper_->add_forces(state_, outer_);
  if (!paper_damped_) return;
  paper_->add_damping(state_, plan_.damping, outer_);
  if (!history) return;
  std::vector<Vec3>& own = history->connection_damping();
  own.assign(body_.element_count(), Vec3::Zero());
  paper_->add_damping(state_, plan_.damping, own);
}

void Act::step(Clock& clock, History* history, bool row) {
  if (history) history->before(state_, row);
  const bool first = clock.steps == 0;
  const double before = first ? (scene_.run.method == TimeMethod::verlet ? 0 : clock.step) : clock.previous;
  const step::Advance advance{0.5 * (before + clock.step), clock.step,
                              scene_.run.method == TimeMethod::explicit_euler};
  state_.kick = advance.kick;
  sum_forces(history);
  StepOutcome outcome;
  const double end = clock.epoch + static_cast<double>(clock.in_epoch + 1) * clock.step;
  {
    const PassTimer timer(kernel_seconds_);
    const std::vector<Vec3>& outer = varies_ ? outer_ : steady_;
    outcome = implicit_ ? implicit_->advance(state_, outer, advance, end)
                        : stepper_->advance(state_, outer, advance);
  }
  ++clock.in_epoch;
  ++clock.steps;
  state_.time = end;
  held_->impose(state_, stepper_->mass(), advance);
  if (history) {
    std::vector<Vec3> supports(body_.element_count(), Vec3::Zero());
    held_->add_forces(supports);
    history->after(state_, outcome, stepper_->damping_force(), supports, first ? 0 : clock.previous,
                   clock.step);
  }
  clock.previous = clock.step;
  if (!(outcome.smallest_jacobian > 0)) throw DivergedError(where_it_folds(body_, state_.displacement));
}

void Act::close_books(const Clock& clock, History& history) {
  State last = state_;
  const Stepper::Memory memory = stepper_->memory();
  Clock beyond = clock;
  step(beyond, &history, true);
  state_ = std::move(last);
  stepper_->restore(memory);
}

void Act::store(const State& state) {
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

void Act::report(const Clock& clock, SimulateResult& result) {
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
  result.timed = TimedSummary{*state_.time, clock.steps, clock.step, stepper_->isa(), {}};
  result.passes.push_back(
      {"cells", fmt::format("model of every part, kernel {}", stepper_->isa()), kernel_seconds_});
  if (paper_) result.passes.push_back({"connections", "model of centre-placed parts", paper_seconds_});
  for (const Pass& pass : passes_) result.passes.push_back({pass.name, pass.why, pass.seconds});
}

}  // namespace flexel
