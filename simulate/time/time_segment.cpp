// Per step: forces of the effects that change, the kernel, held elements, and where asked the books.
#include "simulate/time/time_segment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "simulate/matter/masses.h"
#include "simulate/models/rest_shape.h"
#include "simulate/paper/connection_friction.h"
#include "simulate/probes/report.h"
#include "simulate/scene/coming_parts.h"
#include "simulate/stepping/failure_messages.h"

namespace flexel::simulate {
namespace {

constexpr double kShareOfBound = 0.9;  // of the bound: it may fall between two checks
constexpr double kStepsAhead = 100;    // steps from one of them to the next
constexpr int kImplicitSteps = 200;    // in a run, unless the scene says otherwise
constexpr int kFailures = 30;          // of Newton's method within an implicit step
constexpr std::uint64_t kRenew = 10;   // implicit steps that one tangent may serve
constexpr double kRunaway = 1e4;       // of the body's diagonal: a displacement that no scene means

bool has_cells_of_model_cells(const Problem& problem) {
  const auto is_springs = [](Model model) { return model == Model::springs; };
  return problem.body.cell_count() > 0 &&
         !(problem.models.size() == problem.body.parts.size() &&
           std::all_of(problem.models.begin(), problem.models.end(), is_springs));
}

}  // namespace

// Adds the time of its scope to `seconds`, but for what the effects took of it.
class TimeSegment::ModelTimer {
 public:
  ModelTimer(const TimeSegment& segment, double& seconds)
      : segment_(segment), seconds_(seconds), others_(segment.effect_seconds()) {}
  ~ModelTimer() {
    const std::chrono::duration<double> all = std::chrono::steady_clock::now() - began_;
    seconds_ += all.count() - (segment_.effect_seconds() - others_);
  }
  ModelTimer(const ModelTimer&) = delete;
  ModelTimer& operator=(const ModelTimer&) = delete;

 private:
  const TimeSegment& segment_;
  double& seconds_;
  double others_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

double TimeSegment::effect_seconds() const {
  double sum = 0;
  for (const ActiveEffect& effect : effects_) sum += effect.seconds;
  return sum;
}

TimeSegment::TimeSegment(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress,
                         const SegmentStart& beginning, State state)
    : body_(body),
      scene_(scene),
      progress_(progress),
      problem_(timed_problem(body, scene, beginning)),
      fused_(beginning.fused),
      probes_(place_probes(scene, problem_)),
      effects_(active_effects(scene.coming_parts.empty() ? scene.effects : without_coming_parts(scene, body),
                              problem_)),
      state_(std::move(state)) {
  const bool fresh = beginning.fresh;
  if (fresh) report_materials(problem_, progress_);
  name_materials(body_, problem_.materials);
  configure_kernel();
  add_fused();
  begin_effects(beginning);
  refuse_held_rigid();
  bound_.emplace(problem_, effects_, plan_);
  // Damping may cut the step by 2; beyond that every step has stages for it.
  const bool implicit = scene.run.method == TimeMethod::implicit_euler;
  const bool by_steps =
      implicit || scene.run.method == TimeMethod::explicit_euler || bound_->damps_explicitly();
  const bool book = !options.history.empty() && !implicit;
  stepper_.emplace(problem_, plan_, book, options.isa);
  stepper_->read_memory(body.cell_columns);
  held_.emplace(constraints_, body_, state_, fresh);
  held_->go_on_beyond(*scene.run.time);  // steps that are taken back
  if (!by_steps) staged_.emplace(*stepper_, *held_, book);
  make_forces();
  if (implicit)
    make_implicit();
  else if (has_cells_of_model_cells(problem_))
    guard_.emplace(problem_);
}

// The effects are asked in any order, and then whether what all have asked suffices.
void TimeSegment::configure_kernel() {
  plan_.damping.assign(body_.parts.size(), 0);
  plan_.rest_shapes = RestShapes(body_).any();
  plan_.broken_springs = body_.cell_columns.contains("broken_springs");
  for (const ActiveEffect& effect : effects_) effect->configure_kernel(plan_);
  for (const ActiveEffect& effect : effects_) effect->check_kernel(plan_);
}

void TimeSegment::add_fused() {
  if (fused_.empty()) return;
  const auto shared = std::make_shared<FusedConnections>(fused_connections(
      body_, fused_, plan_, ConnectionFriction::coefficients(scene_.get<ConnectionFriction>(), problem_)));
  effects_.push_back(activate(FusedPoints(body_, shared)));
  joined_ = static_cast<FusedPoints*>(&effects_.back().untimed());
  if (std::optional<FusedLosses> losses = FusedLosses::make(body_, shared, lumped_masses(problem_)))
    effects_.push_back(activate(std::move(*losses)));
}

void TimeSegment::begin_effects(const SegmentStart& beginning) {
  if (beginning.fresh)
    for (const ActiveEffect& effect : effects_) effect->add_initial_state(state_);
  if (beginning.fresh)
    for (const ActiveEffect& effect : effects_) effect->start(state_);
  for (const ActiveEffect& effect : effects_) {
    effect->begin(state_);
    effect->constrain(constraints_);
    for (const auto& [name, transferred] : beginning.transferred_states)
      if (name == effect.name) effect->restore_from(transferred);
  }
}

void TimeSegment::spare_mass() {
  const bool asked = paper_ || euler_ || !constraints_.mask.empty() ||
                     std::any_of(effects_.begin(), effects_.end(),
                                 [](const ActiveEffect& effect) { return effect->needs_mass(); });
  if (!asked) stepper_->drop_mass();
}

void TimeSegment::refuse_held_rigid() const {
  if (constraints_.mask.empty()) return;
  for (std::size_t p = 0; p < problem_.rigidity.size(); ++p)
    for (std::uint32_t e = body_.parts[p].element_begin; e < body_.parts[p].element_end; ++e)
      if (problem_.rigidity[p] != Rigidity::none && constraints_.mask[e])
        throw InputError(scene_.name,
                         fmt::format("part \"{}\" is rigid and held by a [[fix]] or [[move]]: lead "
                                     "it with a [[manipulator]], which without a path stays",
                                     body_.parts[p].name));
}

void TimeSegment::make_implicit() {
  const auto refuse = [&](const std::string& what) {
    throw InputError(scene_.name,
                     fmt::format("[run] method = \"implicit\" does not take {}: leave \"method\" out", what));
  };
  if (!plan_.plasticity.empty()) refuse("[plasticity]");
  if (!plan_.fracture.empty()) refuse("[fracture]");
  for (const ActiveEffect& effect : effects_)
    if (const std::string what = effect->refuses_implicit_steps(); !what.empty()) refuse(what);
  euler_.emplace(problem_, effects_, plan_, stepper_->mass(), scene_.run.tolerance);
}

void TimeSegment::make_forces() {
  for (const ActiveEffect& effect : effects_) {
    if (effect->account() == EnergyAccount::none) continue;
    varies_ = varies_ || !effect->constant();
    if (!effect->constant()) continue;
    if (steady_.empty()) steady_.assign(body_.element_count(), Vec3::Zero());
    effect->add_forces(state_, steady_);
  }
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    if (body_.parts[p].placement != Placement::centre) continue;
    if (!paper_) paper_.emplace(problem_);
    varies_ = true;
  }
  if (paper_) {
    yield_.emplace(problem_, plan_, *paper_);
    if (!yield_->acts()) yield_.reset();
    for (const ActiveEffect& effect : effects_) effect->attach(*paper_, plan_.damping);
  }
}

std::unique_ptr<EnergyHistory> TimeSegment::make_history(EnergyBalance balance) const {
  auto history = std::make_unique<EnergyHistory>(problem_, effects_, probes_, stepper_->mass(),
                                                 paper_ ? &*paper_ : nullptr, plan_, std::move(balance));
  for (std::size_t p = 0; p < effects_.size(); ++p)
    if (effects_[p]->constant() && !history->forces_of(p).empty())
      effects_[p]->add_forces(state_, history->forces_of(p));
  return history;
}

void TimeSegment::look() {
  const ModelTimer timer(*this, check_seconds_);
  stepper_->mark_broken(body_.broken);
  bound_->look(state_, paper_ ? &*paper_ : nullptr, stepper_->mass());
  if (guard_)
    guard_->look(state_, kStepsAhead * std::min(bound_->longest(staged_.has_value()), *scene_.run.time));
}

void TimeSegment::choose_step(Clock& clock) {
  look();
  choose_step_as_seen(clock);
}

void TimeSegment::choose_step_as_seen(Clock& clock) {
  const double longest = bound_->longest(staged_.has_value());
  if (!(longest > 0)) throw DivergedError(where_it_folds(problem_, state_, scene_.run.method));
  double step = kShareOfBound * longest;
  if (euler_) {
    step = scene_.run.step.value_or(*scene_.run.time / kImplicitSteps);
  } else if (scene_.run.step) {
    if (clock.steps == 0 && *scene_.run.step > longest)
      throw InputError(scene_.name,
                       fmt::format("[run] step = {:.4g} s is above {:.4g} s, the longest stable one",
                                   *scene_.run.step, longest));
    step = std::min(clock.steps == 0 ? longest : step, *scene_.run.step);
  }
  for (const ActiveEffect& effect : effects_)
    if (!euler_ && !scene_.run.step) step = std::min(step, effect->first_step());
  clock.damping_rate = bound_->damping_rate();
  clock.epoch = *state_.time;
  clock.in_epoch = 0;
  const double left = clock.until - clock.epoch;
  // without stiffness there is no bound: a thousand steps draw the path
  if (!std::isfinite(step)) step = *scene_.run.time / 1000;
  if (!(step > 1e-12 * *scene_.run.time))
    throw DivergedError(fmt::format("the stable step has fallen to {:.3g} s: {}", step,
                                    where_it_folds(problem_, state_, scene_.run.method)));
  clock.step = left / std::max(1.0, std::ceil(left / step - 1e-9));
}

void TimeSegment::refuse_unsound() {
  double farthest = 0;
  std::size_t where = 0;
  for (std::size_t e = 0; e < state_.displacement.size(); ++e) {
    const Vec3& u = state_.displacement[e];
    const double far = u.allFinite() ? u.norm() : std::numeric_limits<double>::infinity();
    if (!(far > farthest)) continue;
    farthest = far;
    where = e;
  }
  if (!(farthest < kRunaway * (1 + body_extent(body_))))
    throw DivergedError(runs_away_at(body_.rest[where], scene_.run.method));
  if (euler_) return;  // its steps end with every cell the right way round
  look();
  if (!(bound_->longest(staged_.has_value()) > 0))
    throw DivergedError(where_it_folds(problem_, state_, scene_.run.method));
}

void TimeSegment::adapt_step(Clock& clock) {
  if (euler_) return;
  clock.damping_rate = bound_->damping_rate();
  const double longest = bound_->longest(staged_.has_value());
  if (clock.step > 0.97 * longest || (!scene_.run.step && clock.step < 0.6 * kShareOfBound * longest))
    choose_step_as_seen(clock);  // refuse_unsound() has looked
}

void TimeSegment::renew_damping(Clock& clock) {
  if (staged_ && bound_->outgrows(clock.damping_rate, state_, clock.step, clock.steps))
    clock.damping_rate = bound_->damping_rate();
}

bool TimeSegment::is_fast(const Clock& clock, int steps) const {
  constexpr double kFast = 0.25;
  return bound_->travel(state_, steps * clock.step) >= kFast;
}

std::vector<PartTouch> TimeSegment::touches(double ahead) {
  std::vector<PartTouch> touches(body_.parts.size());
  for (const ActiveEffect& effect : effects_) effect->add_touches(state_, ahead, touches);
  return touches;
}

double TimeSegment::stored() {
  double sum = 0;
  for (const ActiveEffect& effect : effects_)
    if (effect->account() == EnergyAccount::stored) sum += effect->energy(state_);
  return sum;
}

bool TimeSegment::needs_step_recheck() const {
  if (guard_ && guard_->needs_step_recheck()) return true;
  return std::any_of(effects_.begin(), effects_.end(),
                     [&](const ActiveEffect& effect) { return effect->needs_step_recheck(state_); });
}

// Calls add(outer_); where the books want to know, `own` (elements) becomes what it added. So the sum, and
// with it the motion, has the same bits with books and without.
template <class Add>
void TimeSegment::add_apart(std::vector<Vec3>* own, const Add& add) {
  if (own) *own = outer_;
  add(outer_);
  if (own) parallel_for_each(own->size(), [&](std::size_t e) { (*own)[e] = outer_[e] - (*own)[e]; });
}

// Those that are constant but once. Where no other acts, as contacts do not in free flight, their sum as it is.
const std::vector<Vec3>& TimeSegment::sum_forces(EnergyHistory* history) {
  const bool guarded = guard_ && guard_->watches();
  const bool needed = guarded || (varies_ && (history || paper_));
  const auto acts = [&](const ActiveEffect& effect) {
    return effect.untimed().account() != EnergyAccount::none && !effect.untimed().constant() &&
           effect->acts(state_);
  };
  if (!needed && (!varies_ || std::none_of(effects_.begin(), effects_.end(), acts))) return steady_;
  outer_ = steady_;
  if (outer_.empty()) outer_.assign(body_.element_count(), Vec3::Zero());
  for (std::size_t p = 0; p < effects_.size(); ++p) {
    const ActiveEffect& effect = effects_[p];
    if (effect.untimed().account() == EnergyAccount::none || effect.untimed().constant()) continue;
    add_apart(history && !history->forces_of(p).empty() ? &history->forces_of(p) : nullptr,
              [&](std::vector<Vec3>& sum) { effect->add_forces(state_, sum); });
  }
  if (paper_) add_connection_forces(history);
  if (!guarded) return outer_;
  const ScopeTimer timer(kernel_seconds_);
  guard_->add_forces(state_, outer_);
  return outer_;
}

void TimeSegment::add_connection_forces(EnergyHistory* history) {
  const ScopeTimer timer(paper_seconds_);
  if (const PaperModel::SmallestVolume least = paper_->smallest_volume(state_); !(least.value > 0))
    throw DivergedError(folds_at("an element", body_.rest[least.element], scene_.run.method));
  paper_->add_forces(state_, outer_);
  if (!damps_connections()) return;
  add_apart(history ? &history->connection_damping() : nullptr,
            [&](std::vector<Vec3>& sum) { paper_->add_damping(state_, plan_.damping, sum); });
}

void TimeSegment::step_implicitly(Clock& clock, EnergyHistory* history, bool row) {
  const ModelTimer timer(*this, kernel_seconds_);
  if (history && row) history->add_row_of(state_, euler_->supports());
  if (renews(clock)) euler_->forget();
  const double end = clock.epoch + static_cast<double>(clock.in_epoch + 1) * clock.step;
  int failures = 0;
  while (*state_.time < end) {
    const ImplicitStep told = euler_->advance(state_, end, clock.step, hear_);
    newton_iterations_ += told.newton_iterations;
    cg_iterations_ += told.cg_iterations;
    failures += told.failures;
    if (told.step == 0 || failures > kFailures)
      throw DivergedError(fmt::format(
          "Newton's method ends nowhere, with steps of {:.3g} s and {}: {}{}; load it more slowly "
          "or give a shorter [run] step",
          clock.step, told.step == 0 ? "down to 1/1024 of it" : fmt::format("{} shorter ones", failures),
          told.trouble, squeezed_most(problem_, state_)));
    held_->settle(state_, euler_->supports());
    if (history) enter_implicit_step(*history);
    euler_->finish(state_);
  }
  ++clock.in_epoch;
  ++clock.steps;
  clock.previous = clock.step;
}

void TimeSegment::enter_implicit_step(EnergyHistory& history) {
  for (std::size_t p = 0; p < effects_.size(); ++p)
    if (std::vector<Vec3>& own = history.forces_of(p); !own.empty()) {
      std::fill(own.begin(), own.end(), Vec3::Zero());
      euler_->add_forces(p, state_, own);
    }
  history.enter(euler_->moved(), euler_->damping_force(), euler_->supports(),
                euler_->numerical_dissipation(state_));
}

bool TimeSegment::renews(const Clock& clock) const {
  return !euler_ || clock.steps % kRenew == 0;
}

TimeSegment::Memory TimeSegment::memory() const {
  Memory memory;
  memory.cells = stepper_->memory();
  if (yield_) memory.connections = paper_->memory();
  if (euler_) {
    memory.reach = euler_->reach();
    memory.supports = euler_->supports();
  }
  for (const ActiveEffect& effect : effects_) memory.effects.push_back(effect->memory());
  return memory;
}

std::vector<std::pair<std::string, std::vector<double>>> TimeSegment::transferred_states() const {
  std::vector<std::pair<std::string, std::vector<double>>> kept;
  for (const ActiveEffect& effect : effects_) kept.emplace_back(effect.name, effect->transfer_state());
  return kept;
}

void TimeSegment::restore(const Memory& memory) {
  const Stepper::Memory own = stepper_->memory();
  if (memory.cells.fill.size() != own.fill.size() || memory.cells.plastic.size() != own.plastic.size() ||
      memory.cells.springs.size() != own.springs.size() ||
      memory.cells.spring_flow.size() != own.spring_flow.size() || !fits_connections(memory.connections) ||
      (!memory.supports.empty() && (!euler_ || memory.supports.size() != body_.element_count())))
    throw InputError("the checkpoint's memory is not that of its scene and body: it is damaged");
  stepper_->restore(memory.cells);
  if (yield_) paper_->memory() = memory.connections;
  stepper_->mark_broken(body_.broken);
  for (std::size_t p = 0; p < effects_.size() && p < memory.effects.size(); ++p)
    effects_[p]->restore(memory.effects[p]);
  if (!euler_) return;
  euler_->set_reach(memory.reach);
  euler_->set_supports(memory.supports);
}

bool TimeSegment::fits_connections(const ConnectionMemory& memory) const {
  if (!yield_) return memory.flowed.empty() && memory.strain.empty() && memory.broken.empty();
  const ConnectionMemory& own = paper_->memory();
  return memory.flowed.size() == own.flowed.size() && memory.strain.size() == own.strain.size() &&
         memory.broken.size() == own.broken.size();
}

ConnectionLosses TimeSegment::yield_connections() {
  ConnectionLosses losses;
  if (yield_) {
    const ScopeTimer timer(paper_seconds_);
    losses = yield_->advance(state_);
  }
  if (joined_) losses += joined_->tear(state_);
  return losses;
}

void TimeSegment::step(Clock& clock, EnergyHistory* history, bool row) {
  if (euler_) return step_implicitly(clock, history, row);
  const bool first = clock.steps == 0;
  const double before = first ? (scene_.run.method == TimeMethod::verlet ? 0 : clock.step) : clock.previous;
  const step::Advance advance{0.5 * (before + clock.step), clock.step,
                              scene_.run.method == TimeMethod::explicit_euler};
  state_.kick = advance.kick;
  const ConnectionLosses lost = yield_connections();
  if (history) history->before(state_, row, row && guard_ ? guard_->energy(state_) : 0);
  const std::vector<Vec3>& forces = sum_forces(history);
  StepOutcome outcome;
  const double end = clock.epoch + static_cast<double>(clock.in_epoch + 1) * clock.step;
  {
    const ScopeTimer timer(kernel_seconds_);
    outcome = staged_ ? staged_->advance(state_, forces, advance, end, clock.damping_rate)
                      : stepper_->advance(state_, forces, advance);
    if (outcome.broken > 0 && guard_ && guard_->watches() && stepper_->mark_broken(body_.broken))
      outcome.released += guard_->drop_broken(state_);
  }
  if (outcome.broken > 0) stepper_->mark_broken(body_.broken);
  outcome.plastic_work += lost.plastic_work;
  outcome.released += lost.released;
  ++clock.in_epoch;
  ++clock.steps;
  state_.time = end;
  held_->impose(state_, stepper_->mass(), advance);
  for (const ActiveEffect& effect : effects_)
    effect->finish_step(state_, {stepper_->mass(), advance.kick, advance.drift});
  for (const ActiveEffect& effect : effects_) effect->accept(state_);
  if (history) {
    std::vector<Vec3> supports(body_.element_count(), Vec3::Zero());
    held_->add_forces(supports);
    for (const ActiveEffect& effect : effects_) effect->add_support_forces(supports);
    history->after(state_, outcome, staged_ ? staged_->damping_force() : stepper_->damping_force(), supports,
                   first ? 0 : clock.previous, clock.step, before == 0);
  }
  clock.previous = clock.step;
  if (!(outcome.smallest_jacobian > 0))
    throw DivergedError(where_it_folds(problem_, state_, scene_.run.method));
}

void TimeSegment::slow(double factor) {
  const StopWaits whole;
  parallel_for_each(state_.velocity.size(), [&](std::size_t e) { state_.velocity[e] *= factor; });
  for (const ActiveEffect& effect : effects_) effect->begin(state_);
}

void TimeSegment::change_velocities(const std::function<void(State&)>& change) {
  const StopWaits whole;
  change(state_);
  for (const ActiveEffect& effect : effects_) effect->begin(state_);
}

bool TimeSegment::kicks() const {
  return !euler_ && !staged_ && scene_.run.method != TimeMethod::explicit_euler &&
         std::none_of(effects_.begin(), effects_.end(),
                      [](const ActiveEffect& effect) { return effect->finishes_steps(); });
}

void TimeSegment::kick(double time) {
  const StopWaits whole;  // half a kick is no state
  const Stepper::Memory memory = stepper_->memory();
  const ConnectionMemory connections = yield_ ? paper_->memory() : ConnectionMemory{};
  const std::vector<double> joined = joined_ ? joined_->memory() : std::vector<double>();
  const std::vector<Vec3> before = state_.velocity;
  state_.kick = std::abs(time);
  (void)yield_connections();
  (void)stepper_->advance(state_, sum_forces(nullptr), {time, 0, false});
  held_->copy(before, state_.velocity);
  stepper_->restore(memory);
  if (yield_) paper_->memory() = connections;
  if (joined_) joined_->restore(joined);
}

// `tell` hears of the present state while what acts is as the step left it.
void TimeSegment::step_and_take_back(const Clock& clock, EnergyHistory* history,
                                     const std::function<void(const State&)>& tell) {
  const StopWaits whole;
  const State last = state_;
  const Memory before = memory();
  const std::vector<std::uint8_t> broken = body_.broken;
  Clock beyond = clock;
  step(beyond, history, history != nullptr);
  tell(last);
  state_ = last;
  body_.broken = broken;
  restore(before);
}

void TimeSegment::close_books(const Clock& clock, EnergyHistory& history) {
  if (euler_) return history.add_row_of(state_, euler_->supports());
  history.close();
  step_and_take_back(clock, &history, [](const State&) {});
}

void TimeSegment::tell_forces_ahead(const Clock& clock, EnergyHistory* history, SimulateResult& result) {
  if (history && !euler_) history->close();
  if (history && euler_) history->before(state_, false);  // energy that was transferred until now
  step_and_take_back(clock, euler_ ? nullptr : history, [&](const State& last) {
    tell_forces(result, last);
    if (!history || !euler_) return;
    for (const ActiveEffect& effect : effects_) (void)effect->take_transfers(state_);  // that of the step
    history->add_row_of(last, euler_->supports());
  });
}

bool TimeSegment::damps_connections() const {
  for (std::size_t p = 0; p < body_.parts.size(); ++p)
    if (body_.parts[p].placement == Placement::centre && plan_.damping[p] > 0) return true;
  return false;
}

bool TimeSegment::damps() const {
  return std::any_of(plan_.damping.begin(), plan_.damping.end(), [](double tau) { return tau > 0; });
}

}  // namespace flexel::simulate
