// Inertia and damping are two more passes of the mechanics whose equilibrium Newton's method finds; effects
// that resist velocity act as a pass whose velocity is that of the step. The tangent is kept from step to
// step while it serves.
#include "simulate/implicit/implicit_euler.h"

#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "simulate/implicit/damping_matrix.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr double kShortest = 1.0 / 1024;  // of a step
constexpr int kFullIterations = 12;

}  // namespace

ImplicitEuler::ImplicitEuler(const Problem& problem, const std::vector<Pass>& passes,
                             const KernelEffects& plan, const std::vector<double>& mass, double tolerance)
    : problem_(problem),
      mass_(mass),
      tau_(plan.damping),
      tolerance_(tolerance),
      outer_passes_(passes.size()),
      reach_(std::numeric_limits<double>::infinity()),
      mechanics_(problem, all_passes(passes), StiffnessStorage::stored) {
  if (damped_) damping_matrix_ = mechanics_.stiffness();
}

std::vector<Pass> ImplicitEuler::all_passes(const std::vector<Pass>& passes) {
  std::vector<Pass> all;
  for (const Pass& pass : passes) all.push_back(pass.add_resistance ? resisting(pass) : pass);
  for (Pass& pass : all) pass.seconds = 0;
  for (const double tau : tau_) damped_ = damped_ || tau > 0;
  all.push_back(inertia());
  if (damped_) all.push_back(damping());
  return all;
}

Pass ImplicitEuler::inertia() {
  Pass pass;
  pass.energy = [this](const State& state) {
    return 0.5 / (step_ * step_) * parallel_sum<double>(mass_.size(), [&](std::size_t e) {
             return mass_[e] * (state.displacement[e] - target_[e]).squaredNorm();
           });
  };
  pass.add_forces = [this](const State& state, std::vector<Vec3>& forces) {
    parallel_for_each(mass_.size(), [&](std::size_t e) {
      forces[e] -= mass_[e] / (step_ * step_) * (state.displacement[e] - target_[e]);
    });
  };
  pass.add_stiffness = [this](const State&, BlockMatrix& matrix) {
    parallel_for_each(mass_.size(), [&](std::size_t e) {
      matrix.values[diagonal_position(matrix, e)].diagonal().array() += mass_[e] / (step_ * step_);
    });
  };
  return pass;
}

Pass ImplicitEuler::damping() {
  const auto pulled = [this](const State& state) {
    std::vector<Vec3> moved(mass_.size()), forces(mass_.size());
    parallel_for_each(mass_.size(), [&](std::size_t e) {
      moved[e] = (state.displacement[e] - before_.displacement[e]) / step_;
    });
    multiply(damping_matrix_, moved, forces);
    return std::pair{std::move(moved), std::move(forces)};
  };
  Pass pass;
  pass.energy = [this, pulled](const State& state) {
    const auto [moved, forces] = pulled(state);
    return 0.5 * step_ * dot(moved, forces);
  };
  pass.add_forces = [pulled](const State& state, std::vector<Vec3>& sum) {
    const std::vector<Vec3> forces = pulled(state).second;
    parallel_for_each(sum.size(), [&](std::size_t e) { sum[e] -= forces[e]; });
  };
  pass.add_stiffness = [this](const State&, BlockMatrix& matrix) {
    parallel_for_each(matrix.values.size(),
                      [&](std::size_t i) { matrix.values[i] += damping_matrix_.values[i] / step_; });
  };
  return pass;
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

Pass ImplicitEuler::resisting(const Pass& pass) {
  Pass made = pass;
  made.energy = [this, pass](const State& state) { return step_ * pass.resistance(along_the_way(state)); };
  made.add_forces = [this, pass](const State& state, std::vector<Vec3>& forces) {
    pass.add_forces(along_the_way(state), forces);
  };
  made.add_stiffness = [this, pass](const State& state, BlockMatrix& matrix) {
    pass.add_resistance(along_the_way(state), 1 / step_, matrix);
  };
  return made;
}

// What forces the residual is measured against where everything moves freely: those of the passes as the step
// begins.
double ImplicitEuler::force_scale(const State& trial) const {
  std::vector<Vec3> forces(mass_.size(), Vec3::Zero());
  for (std::size_t p = 0; p < outer_passes_; ++p)
    if (mechanics_.passes()[p].add_forces && mechanics_.passes()[p].couples.empty())
      mechanics_.passes()[p].add_forces(trial, forces);
  return std::sqrt(dot(forces, forces));
}

bool ImplicitEuler::solve(State& trial, NewtonSteps steps,
                          const std::function<void(const std::string&)>& progress, ImplicitStep& told) {
  NewtonOptions options;
  options.steps = steps;
  options.tolerance = tolerance_;
  if (steps == NewtonSteps::full) options.max_iterations = kFullIterations;
  options.least_scale = force_scale(trial);
  const NewtonOutcome outcome = newton(mechanics_, trial, options, progress, &memory_);
  told.newton_iterations += outcome.iterations;
  told.cg_iterations += outcome.cg_iterations;
  told.trouble = outcome.trouble;
  return outcome.converged;
}

bool ImplicitEuler::attempt(State& state, double step, double end,
                            const std::function<void(const std::string&)>& progress, ImplicitStep& told) {
  if (step != step_) forget();
  step_ = step;
  before_ = state;
  target_.resize(mass_.size());
  parallel_for_each(mass_.size(),
                    [&](std::size_t e) { target_[e] = state.displacement[e] + step * state.velocity[e]; });
  if (damped_) set_damping(problem_, mechanics_.stencil(), tau_, before_.displacement, damping_matrix_);
  State start = state;
  start.time = end;
  start.kick = 0;
  State onward = start;
  onward.displacement = target_;
  if (mechanics_.energy(onward) < mechanics_.energy(start)) start.displacement = target_;
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
  supports_ = mechanics_.forces(trial).total;
  parallel_for_each(mass_.size(), [&](std::size_t e) {
    for (int axis = 0; axis < 3; ++axis)
      supports_[e][axis] = mechanics_.constraints().mask[e] >> axis & 1 ? -supports_[e][axis] : 0;
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
  for (const double shortest = std::min(left, kShortest * whole); step >= shortest; step /= 2) {
    if (attempt(state, step, step == left ? end : *state.time + step, progress, told)) {
      told.step = step;
      reach_ = step == left ? std::max(reach_, 2 * step) : 2 * step;
      return told;
    }
    forget();
    ++told.failures;
    reach_ = step / 2;
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
  mechanics_.add_elastic_forces(state, forces);
  const double moved = parallel_sum<double>(mass_.size(), [&](std::size_t e) {
    return 0.5 * mass_[e] * (state.velocity[e] - before_.velocity[e]).squaredNorm() -
           forces[e].dot(moved_[e]);
  });
  return moved + mechanics_.elastic_energy(before_) - mechanics_.elastic_energy(state);
}

void ImplicitEuler::add_forces(std::size_t pass, const State& state, std::vector<Vec3>& forces) const {
  if (mechanics_.passes()[pass].add_forces) mechanics_.passes()[pass].add_forces(state, forces);
}

void ImplicitEuler::add_seconds(std::vector<Pass>& passes) const {
  for (std::size_t p = 0; p < passes.size(); ++p) passes[p].seconds += mechanics_.passes()[p].seconds;
}

}  // namespace flexel::simulate
