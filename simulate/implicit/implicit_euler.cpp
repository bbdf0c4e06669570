// Inertia and damping are two more effects of the mechanics whose equilibrium Newton's method finds; effects
// that resist velocity act with that of the step. The tangent is kept from step to
// step while it serves.
#include "simulate/implicit/implicit_euler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "simulate/implicit/damping_matrix.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr double kShortest = 1.0 / 1024;  // of a step
constexpr int kFullIterations = 12;
// Elements: contact changes the tangent in every iteration, and a factorisation is dearer than a hierarchy.
constexpr std::size_t kDirectRowsTouching = 100;
// Error of the linear model over a step of Newton's method, relative, under which the cells' tangent serves for the next one.
constexpr double kKeepCellsBelow = 0.1;
constexpr int kPasses = 12;            // of Newton's method, until what is held fixed in it suits
constexpr int kLooks = 40;             // at a step, each at a shorter one, until effects bear it
constexpr double kBorneWhole = 0.999;  // share that needs no other look
constexpr double kSameStep = 1e-9;     // by which the length may differ for a tangent to be kept

}  // namespace

ImplicitEuler::ImplicitEuler(const Problem& problem, const std::vector<ActiveEffect>& effects,
                             const KernelEffects& plan, const std::vector<double>& mass, double tolerance)
    : problem_(problem),
      effects_(effects),
      mass_(mass),
      tau_(plan.damping),
      tolerance_(tolerance),
      reach_(std::numeric_limits<double>::infinity()),
      seconds_(effects.size(), 0) {
  for (const double tau : tau_) damped_ = damped_ || tau > 0;
  for (const ActiveEffect& effect : effects)
    touches_ = touches_ || effect->account() == EnergyAccount::stored;
  make_mechanics();
}

// With the pattern of what effects couple now.
void ImplicitEuler::make_mechanics() {
  forget();
  if (mechanics_)
    for (std::size_t p = 0; p < effects_.size(); ++p) seconds_[p] += mechanics_->effects()[p].seconds;
  mechanics_.emplace(problem_, all_effects(), storage());
  inertia_of_ = 0;
  coupled_ = mechanics_->coupled_elements();
  std::sort(coupled_.begin(), coupled_.end());
  if (damped_) damping_matrix_ = mechanics_->stiffness();
}

// The damping matrix, and what resists velocity, have places only beside stored cells.
StiffnessStorage ImplicitEuler::storage() const {
  const bool resists = std::any_of(effects_.begin(), effects_.end(),
                                   [](const ActiveEffect& effect) { return effect->resists(); });
  return damped_ || resists || !CellStiffness::fits(problem_, PaperModel(problem_)) ? StiffnessStorage::stored
                                                                                    : StiffnessStorage::made;
}

void ImplicitEuler::set_inertia() {
  inertia_of_ = step_;
  std::vector<double> inertia(mass_.size());
  for (std::size_t e = 0; e < inertia.size(); ++e) inertia[e] = mass_[e] / (step_ * step_);
  mechanics_->set_inertia(std::move(inertia));
}

// An effect of the run as the mechanics of a step sees it: one that resists velocity has that of the step.
class ImplicitEuler::EffectOfStep : public Effect {
 public:
  static constexpr const char* name = "";
  EffectOfStep(const ImplicitEuler& euler, Effect& effect) : euler_(&euler), effect_(&effect) {}
  [[nodiscard]] std::string why() const override { return effect_->why(); }
  [[nodiscard]] bool adds_stiffness() const override {
    return effect_->adds_stiffness() || effect_->resists();
  }
  [[nodiscard]] bool follows() const override { return effect_->follows(); }
  [[nodiscard]] std::vector<CoupledElements> couples() const override { return effect_->couples(); }
  [[nodiscard]] std::vector<std::uint32_t> may_pull_at() const override { return effect_->may_pull_at(); }
  [[nodiscard]] bool tells_where_it_pulls() const override { return effect_->tells_where_it_pulls(); }
  void constrain(Constraints& constraints) override {
    effect_->constrain(constraints);
    effect_->constrain_implicit_steps(constraints);
  }
  [[nodiscard]] double energy(const State& state) override {
    return effect_->resists() ? euler_->step_ * effect_->resistance(euler_->along_the_way(state))
                              : effect_->energy(state);
  }
  void add_forces(const State& state, std::vector<Vec3>& forces) override {
    effect_->resists() ? effect_->add_forces(euler_->along_the_way(state), forces)
                       : effect_->add_forces(state, forces);
  }
  void add_stiffness(const State& state, BlockMatrix& matrix) override {
    effect_->resists() ? effect_->add_resistance(euler_->along_the_way(state), 1 / euler_->step_, matrix)
                       : effect_->add_stiffness(state, matrix);
  }
  void add_positive_stiffness(const State& state, BlockMatrix& matrix) override {
    effect_->resists() ? add_stiffness(state, matrix) : effect_->add_positive_stiffness(state, matrix);
  }
  void add_force_change(const State& state, const std::vector<Vec3>& change, bool transposed,
                        std::vector<Vec3>& forces) override {
    effect_->add_force_change(state, change, transposed, forces);
  }

 private:
  const ImplicitEuler* euler_;
  Effect* effect_;
};

class ImplicitEuler::Inertia : public Effect {
 public:
  static constexpr const char* name = "inertia";
  explicit Inertia(const ImplicitEuler& euler) : euler_(&euler) {}
  [[nodiscard]] std::string why() const override { return "implicit steps"; }
  [[nodiscard]] double energy(const State& state) override {
    const double step = euler_->step_;
    return 0.5 / (step * step) * parallel_sum<double>(euler_->mass_.size(), [&](std::size_t e) {
             return euler_->mass_[e] * (state.displacement[e] - euler_->target_[e]).squaredNorm();
           });
  }
  void add_forces(const State& state, std::vector<Vec3>& forces) override {
    const double step = euler_->step_;
    parallel_for_each(euler_->mass_.size(), [&](std::size_t e) {
      forces[e] -= euler_->mass_[e] / (step * step) * (state.displacement[e] - euler_->target_[e]);
    });
  }

 private:
  const ImplicitEuler* euler_;
};

class ImplicitEuler::StepDamping : public Effect {
 public:
  static constexpr const char* name = "damping";
  explicit StepDamping(const ImplicitEuler& euler) : euler_(&euler) {}
  [[nodiscard]] std::string why() const override { return "implicit steps"; }
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  [[nodiscard]] double energy(const State& state) override {
    const auto [moved, forces] = pulled(state);
    return 0.5 * euler_->step_ * dot(moved, forces);
  }
  void add_forces(const State& state, std::vector<Vec3>& sum) override {
    const std::vector<Vec3> forces = pulled(state).second;
    parallel_for_each(sum.size(), [&](std::size_t e) { sum[e] -= forces[e]; });
  }
  void add_stiffness(const State&, BlockMatrix& matrix) override {
    parallel_for_each(matrix.values.size(), [&](std::size_t i) {
      matrix.values[i] += euler_->damping_matrix_.values[i] / euler_->step_;
    });
  }

 private:
  // m/s, the velocity of the step; N, what damping takes for it
  [[nodiscard]] std::pair<std::vector<Vec3>, std::vector<Vec3>> pulled(const State& state) const {
    const std::size_t n = euler_->mass_.size();
    std::vector<Vec3> moved(n), forces(n);
    parallel_for_each(n, [&](std::size_t e) {
      moved[e] = (state.displacement[e] - euler_->before_.displacement[e]) / euler_->step_;
    });
    multiply(euler_->damping_matrix_, moved, forces);
    return {std::move(moved), std::move(forces)};
  }
  const ImplicitEuler* euler_;
};

std::vector<ActiveEffect> ImplicitEuler::all_effects() {
  std::vector<ActiveEffect> all;
  for (const ActiveEffect& effect : effects_) all.push_back(activate(EffectOfStep(*this, effect.untimed())));
  all.push_back(activate(Inertia(*this)));
  if (damped_) all.push_back(activate(StepDamping(*this)));
  return all;
}

// The shape at the start of the step and the velocity that leads to `trial`.
State ImplicitEuler::along_the_way(const State& trial) const {
  State state = before_;
  state.time = trial.time;
  state.kick = 0;
  parallel_for_each(mass_.size(), [&](std::size_t e) {
    state.velocity[e] = (trial.displacement[e] - before_.displacement[e]) / step_;
  });
  return state;
}

// What forces [N] the residual is measured against where everything moves freely: those of the effects as the
// step begins, before anything is led. A tool led into a part that has not moved yet would press with forces that
// the step never has, and beside them those that it has would be nothing.
double ImplicitEuler::force_scale() const {
  State state = before_;
  state.time = aimed_.time;
  std::vector<Vec3> forces(mass_.size(), Vec3::Zero());
  for (std::size_t p = 0; p < effects_.size(); ++p)
    if (mechanics_->effects()[p].couples.empty()) mechanics_->effects()[p]->add_forces(state, forces);
  return std::sqrt(dot(forces, forces));
}

// What Newton's method finds without a step counts only where it is a place to be: where surfaces have passed through
// one another no pair presses any more, which looks like equilibrium.
bool ImplicitEuler::solve(State& trial, NewtonSteps steps,
                          const std::function<void(const std::string&)>& progress, ImplicitStep& told) {
  NewtonOptions options;
  options.steps = steps;
  options.tolerance = tolerance_;
  if (steps == NewtonSteps::full) options.max_iterations = kFullIterations;
  options.least_scale = force_scale();
  if (touches_) options.direct.rows = kDirectRowsTouching;
  options.keep_cells_below = kKeepCellsBelow;
  for (int pass = 0; pass < kPasses; ++pass) {
    const NewtonOutcome outcome = newton(
        *mechanics_, trial, options, [&](double, const std::string& note) { progress(note); }, &memory_);
    told.newton_iterations += outcome.iterations;
    told.cg_iterations += outcome.cg_iterations;
    told.trouble = outcome.trouble;
    if (!outcome.converged) return false;
    if (!settles(trial)) continue;
    Forces found = mechanics_->forces(trial);
    if (mechanics_->is_sound(trial, found)) {
      supports_ = std::move(found.total);
      return true;
    }
    told.trouble = "surfaces pass through one another within the step";
    return false;
  }
  told.trouble = "friction and damping of contacts do not settle";
  return false;
}

bool ImplicitEuler::settles(const State& found) const {
  bool all = true;
  for (const ActiveEffect& effect : effects_) all = effect->settles(found) && all;
  return all;
}

// Where a step without forces would lead.
void ImplicitEuler::aim(const State& state, double end) {
  step_ = end - *state.time;
  target_.resize(mass_.size());
  parallel_for_each(mass_.size(),
                    [&](std::size_t e) { target_[e] = state.displacement[e] + step_ * state.velocity[e]; });
  aimed_ = state;
  aimed_.time = end;
  aimed_.kick = 0;
  aimed_.displacement = target_;
  for (const ActiveEffect& effect : effects_) effect->lead_to(end, aimed_.displacement);
}

// A step from `state` to `end` [s], or as much of it as effects bear; where it ends. Nothing: they bear none of
// `shortest` [s].
std::optional<double> ImplicitEuler::begin(const State& state, double end, double shortest) {
  const double previous = step_;
  bool recouples = false;
  for (int look = 0;; ++look) {
    aim(state, end);
    State led = aimed_;  // what is prescribed may pull further than what is free goes
    apply(mechanics_->constraints(), problem_.body, led, led.displacement);
    double share = 1;
    for (const ActiveEffect& effect : effects_) {
      const StepBearing bearing = effect->begin_implicit_step(state, led, step_);
      share = std::min(share, bearing.share);
      recouples = recouples || bearing.recouples;
    }
    if (!(share < kBorneWhole)) break;
    if (share * step_ < shortest || look == kLooks) return std::nullopt;
    end = *state.time + share * step_;
  }
  if (recouples && !covers_couples()) {
    make_mechanics();
  } else if (recouples) {
    mechanics_->renew_effects_pattern();
    memory_.factored = false;  // what effects had added is gone from the tangent
  }
  if (std::abs(step_ - previous) > kSameStep * previous) forget();
  // Steps differ by rounding: what begins anew must not know of the earlier ones.
  if (!memory_.preconditioner || std::abs(step_ - inertia_of_) > kSameStep * inertia_of_) set_inertia();
  return end;
}

// Whether the matrix has a place for all that effects couple now.
bool ImplicitEuler::covers_couples() const {
  for (const ActiveEffect& effect : effects_) {
    std::vector<CoupledElements> groups = effect->couples();
    std::sort(groups.begin(), groups.end());
    if (!std::includes(coupled_.begin(), coupled_.end(), groups.begin(), groups.end())) return false;
  }
  return true;
}

bool ImplicitEuler::attempt(State& state, const std::function<void(const std::string&)>& progress,
                            ImplicitStep& told) {
  const double step = step_;
  before_ = state;
  if (damped_)
    set_damping(problem_, mechanics_->stencil(), mechanics_->paper(), tau_, before_.displacement,
                damping_matrix_);
  State start = aimed_;
  start.displacement = state.displacement;
  for (const ActiveEffect& effect : effects_) effect->lead_to(*aimed_.time, start.displacement);
  if (mechanics_->energy(aimed_) < mechanics_->energy(start)) start.displacement = aimed_.displacement;
  State trial = start;
  if (!solve(trial, NewtonSteps::full, progress, told)) {
    forget();
    trial = start;
    if (!solve(trial, NewtonSteps::lowering, progress, told)) return false;
  }
  moved_.resize(mass_.size());
  parallel_for_each(mass_.size(), [&](std::size_t e) {
    moved_[e] = trial.displacement[e] - before_.displacement[e];
    trial.velocity[e] = moved_[e] / step;
  });
  parallel_for_each(mass_.size(), [&](std::size_t e) {
    for (int axis = 0; axis < 3; ++axis)
      supports_[e][axis] = mechanics_->constraints().mask[e] >> axis & 1 ? -supports_[e][axis] : 0;
  });
  state = std::move(trial);
  return true;
}

ImplicitStep ImplicitEuler::advance(State& state, double end, double whole,
                                    const std::function<void(const std::string&)>& progress) {
  ImplicitStep told;
  const double left = end - *state.time;
  double step = std::min(left, reach_);
  if (left - step < 0.25 * step) step = left;
  // Steps that shrink without end would come nearer and nearer to what stops them, until nothing is left of
  // them but rounding.
  for (const double shortest = std::min(left, kShortest * whole); step >= shortest;) {
    const double whole_way = step == left ? end : *state.time + step;
    const std::optional<double> borne = begin(state, whole_way, 0.5 * shortest);
    if (!borne) {
      told.trouble = "parts come near one another so fast that contact bears no step of that length";
      return told;
    }
    if (attempt(state, progress, told)) {
      told.step = step_;
      if (*borne < whole_way) return told;  // it says nothing of longer ones
      reach_ = step == left ? std::max(reach_, 2 * step) : 2 * step;
      return told;
    }
    forget();
    ++told.failures;
    reach_ = step = 0.5 * std::min(step, step_);
  }
  return told;
}

std::vector<Vec3> ImplicitEuler::damping_force() const {
  std::vector<Vec3> forces;
  if (!damped_) return forces;
  forces.resize(mass_.size());
  multiply(damping_matrix_, moved_, forces);
  for (Vec3& force : forces) force /= -step_;
  return forces;
}

double ImplicitEuler::numerical_dissipation(const State& state) {
  std::vector<Vec3> forces(mass_.size(), Vec3::Zero());
  mechanics_->add_elastic_forces(state, forces);
  double lost = mechanics_->elastic_energy(before_) - mechanics_->elastic_energy(state);
  for (const ActiveEffect& effect : effects_) {
    if (effect->account() != EnergyAccount::potential) continue;
    effect->add_forces(state, forces);
    lost += effect->energy(before_) - effect->energy(state);
  }
  const double moved = parallel_sum<double>(mass_.size(), [&](std::size_t e) {
    return 0.5 * mass_[e] * (state.velocity[e] - before_.velocity[e]).squaredNorm() -
           forces[e].dot(moved_[e]);
  });
  return moved + lost;
}

void ImplicitEuler::add_forces(std::size_t effect, const State& state, std::vector<Vec3>& forces) const {
  mechanics_->effects()[effect]->add_forces(state, forces);
}

void ImplicitEuler::finish(const State& state) {
  for (const ActiveEffect& effect : effects_) {
    effect->end_implicit_step(state, {mass_, step_, step_}, supports_);
    effect->accept(state);
  }
}

double ImplicitEuler::add_seconds(const std::vector<ActiveEffect>& effects) const {
  double sum = 0;
  for (std::size_t p = 0; p < effects.size(); ++p) {
    const double own = seconds_[p] + mechanics_->effects()[p].seconds;
    effects[p].seconds += own;
    sum += own;
  }
  return sum;
}

}  // namespace flexel::simulate
