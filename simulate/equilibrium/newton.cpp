// Inexact Newton (Eisenstat and Walker 1996, choice 1): the conjugate gradients of an iteration go only as
// far as the linear model could be trusted in the last one, and no further than convergence needs. While that
// model was good to a thousandth, the tangent and its preconditioner are kept: small deformations assemble
// and factorise once. Prescribed elements are led to their targets by the first full step, together with what
// the others do in response.
//
// Lowering steps: every step must lower the energy (Armijo) with J > 0 in every cell. A tangent that turns
// out indefinite is assembled again with the cells' moduli projected to their positive part.
//
// Where loads follow the shape (simulate/followers) the tangent is not symmetric: GMRES takes the place of
// conjugate gradients, with the same preconditioner, and steps lower the residual in place of the energy.
//
// Full steps: a linear answer turns thin walls by shear, which stretches them a little; the stresses of that
// stretch exceed those of the bending by far, and a tangent that holds them resists the next step like a
// drum skin. So the geometric stiffness is taken with the stresses that the linear model predicted, which do
// not know of the stretch (mixed integration points: Magisano, Leonetti and Garcea 2017). A plate that bends
// ten times its thickness takes 5 to 10 iterations where lowering steps take 90. The energy may rise on the
// way, so what is reached counts only when the last tangent was positive definite; steps that do not shrink
// end the attempt.
#include "simulate/equilibrium/newton.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/parallel.h"
#include "simulate/followers/gmres.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr double kFirstForcing = 1e-4;  // relative residual of the first linear solve
constexpr double kLargestForcing = 0.1;
constexpr double kKeepTangentBelow = 1e-3;  // model error of the last step under which the tangent is kept
constexpr double kKeepLastTangentBelow = 1e-2;  // ... where one more step with it suffices
constexpr double kArmijo = 1e-4;
constexpr double kSmallestStep = 1.0 / 4096;
constexpr int kMaxCgIterations = 3000;
constexpr int kIterationsOfARefresh = 10;  // of conjugate gradients, that take as long
// Full steps
constexpr double kLooseForcing = 1e-3;
constexpr int kMaxCgOfFullStep = 400;   // more: the tangent has become nearly singular
constexpr int kMoreCgOfProjected = 40;  // than four times the usual: no use, a smaller load is cheaper
constexpr int kStepsToShrink = 8;       // from then on a step is a quarter of the longest, or it has failed
constexpr double kShrunk = 0.25;

double norm(const std::vector<Vec3>& a) {
  return std::sqrt(dot(a, a));
}

// What a force at `u` cannot be better than: rounding in displacements times the stiffness that they meet.
double rounding_floor(const LinearOperator& matrix, const std::vector<Vec3>& u) {
  if (dot(u, u) == 0) return 0;
  const std::vector<Block> diagonal = matrix.diagonal();
  const double squared = parallel_sum<double>(matrix.rows(), [&](std::size_t e) {
    return diagonal[e].diagonal().squaredNorm() * u[e].squaredNorm();
  });
  return 16 * std::numeric_limits<double>::epsilon() * std::sqrt(squared);
}

class Solver {
 public:
  Solver(Mechanics& mechanics, State& state, const NewtonOptions& options, const NewtonProgress& progress,
         NewtonMemory* memory)
      : mechanics_(mechanics),
        state_(state),
        options_(options),
        progress_(progress),
        kept_(memory ? *memory : own_) {
    if (kept_.projected) kept_.factored = false;
    if (options.unstressed) predicted_stress_.assign(mechanics.body().cell_count(), Mat3::Zero());
  }

  NewtonOutcome run();

 private:
  [[nodiscard]] double way_gone() const {
    const double residual = std::max(outcome_.relative_residual, options_.tolerance);
    return std::max(0.0, std::log(residual) / std::log(options_.tolerance));
  }
  // Likewise when the step's linear solution has come to `relative` of its right-hand side: were the step all of it,
  // the residual would be that much less. It is less than half of that where it bends.
  [[nodiscard]] double way_ahead(double relative) const {
    const double more =
        std::log(std::clamp(relative, options_.tolerance, 1.0)) / std::log(options_.tolerance);
    return std::min(1.0, way_gone() + more / 2);
  }
  [[nodiscard]] bool full() const { return options_.steps == NewtonSteps::full; }
  void begin();
  [[nodiscard]] bool arrived();
  bool keeps_cells();
  bool advance();
  void prepare_tangent(bool project);
  void factor();
  void solve_linear(const std::vector<Vec3>& rhs, double forcing);
  LinearResult iterate(const std::vector<Vec3>& rhs, double forcing);
  std::vector<Vec3> right_hand_side();
  bool line_search(const std::vector<Vec3>& residual);
  bool lower_residual();
  bool lead_prescribed();
  bool full_step();
  [[nodiscard]] State moved(double step) const;
  void update_residual();
  [[nodiscard]] double forcing() const;
  [[nodiscard]] double last_forcing() const;

  Mechanics& mechanics_;
  State& state_;
  const NewtonOptions& options_;
  const NewtonProgress& progress_;
  NewtonOutcome outcome_;
  NewtonMemory own_;
  NewtonMemory& kept_;
  std::vector<Vec3> gap_;       // what prescribed elements still have to go; empty when they are there
  std::vector<Vec3> residual_;  // forces on free components
  std::vector<Vec3> direction_;
  double residual_norm_ = 0, scale_ = 0;
  bool sound_ = true;  // the state after a full step
  bool tangent_kept_ = false;
  bool indefinite_ = false;  // conjugate gradients met negative curvature in the last solve
  double longest_step_ = 0;
  std::optional<State> before_;  // where the last full step began, until its stresses have been predicted
  // (cells) Pa, predicted by the last full step's linear model; before it empty, or zero; empty for lowering steps
  std::vector<Mat3> predicted_stress_;
};

void Solver::update_residual() {
  Forces forces = mechanics_.forces(state_);
  sound_ = !before_ || mechanics_.is_sound(state_, forces);
  residual_ = std::move(forces.total);
  clear_prescribed(mechanics_.constraints(), residual_);
  residual_norm_ = norm(residual_);
  scale_ = std::max(forces.scale, options_.least_scale);
  outcome_.relative_residual = scale_ == 0 ? 0 : residual_norm_ / scale_;
}

void Solver::prepare_tangent(bool project) {
  kept_.factored = false;
  if (before_) predicted_stress_ = mechanics_.cells().predicted_stress(*before_, direction_);
  before_.reset();
  mechanics_.assemble(state_, {project, predicted_stress_.empty() ? nullptr : &predicted_stress_});
  kept_.projected = project;
}

// The coarser levels are kept while they save more than they cost in iterations. A refreshed preconditioner
// keeps the aggregates and the rigid motions of the positions it was made at; it is made anew when turning
// has made it poor.
void Solver::factor() {
  mechanics_.eliminate_prescribed();
  const bool keeps = kept_.preconditioner && !kept_.outdated;
  if (keeps)
    kept_.preconditioner->refresh_smoother();
  else if (kept_.preconditioner)
    kept_.preconditioner->refresh();
  else
    kept_.preconditioner = aggregation_multigrid(mechanics_.tangent(),
                                                 node_geometry(mechanics_.body(), state_), options_.direct);
  kept_.stale = keeps;
  kept_.outdated = false;
  kept_.factored = true;
}

// Forces on the free components, less what the way of the prescribed ones pulls with it. Eliminates them from
// the matrix.
std::vector<Vec3> Solver::right_hand_side() {
  std::vector<Vec3> rhs = residual_;
  if (!gap_.empty()) {
    std::vector<Vec3> pulled(rhs.size());
    multiply(mechanics_.whole_tangent(), gap_, pulled);
    for (std::size_t e = 0; e < rhs.size(); ++e) rhs[e] -= pulled[e];
    clear_prescribed(mechanics_.constraints(), rhs);
  }
  return rhs;
}

// Goes on where it is while conjugate gradients promise to arrive. Where coarser levels of an earlier tangent
// have become too poor they are made anew, and the iteration goes on from what it had reached.
LinearResult Solver::iterate(const std::vector<Vec3>& rhs, double forcing) {
  const double decades = std::max(1.0, -std::log10(forcing));
  const double usual = kept_.usual_iterations * decades / 4;
  std::vector<Vec3> left = rhs;
  double share = 1;  // of the right-hand side, that `left` is
  direction_.assign(rhs.size(), Vec3::Zero());
  for (;;) {
    const ScopeTimer timer(outcome_.linear_seconds);
    if (!kept_.factored) factor();
    const bool stale = kept_.stale, bounded = full() && kept_.projected;
    const int most = bounded  ? std::min(kMaxCgOfFullStep, 4 * kept_.usual_iterations + kMoreCgOfProjected)
                     : full() ? kMaxCgOfFullStep
                              : kMaxCgIterations;
    bool stopped = false;
    const auto hopeless = [&](int iteration, double relative) {
      if (!stale && !bounded) return false;
      const double least = stale ? std::max<double>(kIterationsOfARefresh, usual / 2)
                                 : 2 * kept_.usual_iterations + kIterationsOfARefresh;
      const double gained = std::max(1e-3, -std::log10(relative));
      const double more = iteration * std::max(0.0, -std::log10(forcing / share) / gained - 1);
      stopped = iteration >= least && (stale ? more > usual + kIterationsOfARefresh ||
                                                   iteration >= usual + 3 * kIterationsOfARefresh
                                             : more > most);
      return stopped;
    };
    std::vector<Vec3> step;
    const auto solve = mechanics_.follows() ? gmres : static_cast<decltype(&gmres)>(conjugate_gradients);
    LinearResult one = solve(
        mechanics_.whole_tangent(), left, step, *kept_.preconditioner,
        std::min(forcing / share, kLargestForcing), most,
        [&](int iteration, double relative) {
          progress_(
              way_ahead(share * relative),
              fmt::format("newton {}, cg {}, {:.0e}", outcome_.iterations + 1, iteration, share * relative));
        },
        hopeless);
    outcome_.cg_iterations += one.iterations;
    // An ascending direction is of no use beside what is there already.
    if (share == 1 || !(one.indefinite && one.iterations == 0))
      parallel_for_each(rhs.size(), [&](std::size_t e) { direction_[e] += step[e]; });
    one.indefinite = one.indefinite || (full() && (one.iterations == most || (stopped && !stale)));
    if (!stopped || !stale) return one;
    multiply(mechanics_.whole_tangent(), direction_, left);
    parallel_for_each(rhs.size(), [&](std::size_t e) { left[e] = rhs[e] - left[e]; });
    share = norm(left) / norm(rhs);
    kept_.outdated = true;
    kept_.factored = false;
  }
}

void Solver::solve_linear(const std::vector<Vec3>& rhs, double forcing) {
  const bool fresh = !kept_.preconditioner;
  const double decades = std::max(1.0, -std::log10(forcing));
  const LinearResult result = iterate(rhs, forcing);
  indefinite_ = result.indefinite;
  const double before = kept_.usual_iterations * decades / 4;
  if (kept_.stale && result.iterations > before + kIterationsOfARefresh) kept_.outdated = true;
  // A new hierarchy costs a third more than a refreshed one: a few iterations too many are worth it.
  if (fresh) kept_.usual_iterations = static_cast<int>(std::lround(4 * result.iterations / decades));
  const double usual = kept_.usual_iterations * decades / 4;
  const bool poor = !kept_.stale && result.iterations > 1.5 * usual + 4;
  if (result.indefinite && !kept_.projected) {
    prepare_tangent(true);
    const std::vector<Vec3> again = right_hand_side();
    solve_linear(again, forcing);
  } else if (poor) {
    kept_.preconditioner.reset();
    kept_.factored = false;
    kept_.model_error = 1;
  }
}

State Solver::moved(double step) const {
  State trial = state_;
  parallel_for_each(trial.displacement.size(),
                    [&](std::size_t e) { trial.displacement[e] += step * direction_[e]; });
  return trial;
}

// The first step of a share with prescribed elements: as much of it as every cell bears. Energy is no guide
// here.
bool Solver::lead_prescribed() {
  for (std::size_t e = 0; e < gap_.size(); ++e) direction_[e] += gap_[e];
  double step = 1;
  while (step >= kSmallestStep) {
    State trial = moved(step);
    if (std::isfinite(mechanics_.energy(trial))) {
      state_ = std::move(trial);
      for (Vec3& gap : gap_) gap *= 1 - step;
      if (step == 1) {
        apply(mechanics_.constraints(), mechanics_.body(), state_, state_.displacement);
        gap_.clear();
      }
      return true;
    }
    step /= 2;
  }
  return false;
}

// Where loads have no energy: as far as the forces that are left fall.
bool Solver::lower_residual() {
  for (double step = 1; step >= kSmallestStep; step /= 2) {
    State trial = moved(step);
    if (!std::isfinite(mechanics_.energy(trial))) continue;
    Forces forces = mechanics_.forces(trial);
    clear_prescribed(mechanics_.constraints(), forces.total);
    if (!(norm(forces.total) < (1 - kArmijo * step) * residual_norm_)) continue;
    state_ = std::move(trial);
    return true;
  }
  return false;
}

bool Solver::line_search(const std::vector<Vec3>& residual) {
  if (mechanics_.follows()) return lower_residual();
  const double slope = -dot(residual, direction_);
  if (!(slope < 0)) return false;
  const double before = mechanics_.energy(state_);
  const double noise = 1e-12 * std::abs(before);
  for (double step = 1; step >= kSmallestStep; step /= 2) {
    State trial = moved(step);
    const double after = mechanics_.energy(trial);
    if (!std::isfinite(after)) continue;
    bool accepted = after <= before + kArmijo * step * slope;
    if (!accepted && after <= before + noise) {
      // Near the minimum the energy no longer has the digits; the forces do.
      Forces forces = mechanics_.forces(trial);
      clear_prescribed(mechanics_.constraints(), forces.total);
      accepted = norm(forces.total) < 0.9 * residual_norm_;
    }
    if (accepted) {
      state_ = std::move(trial);
      return true;
    }
  }
  return false;
}

// As far as the linear model says, in one go. False where it leads nowhere.
bool Solver::full_step() {
  for (std::size_t e = 0; e < gap_.size(); ++e) direction_[e] += gap_[e];
  const double length = norm(direction_);
  longest_step_ = std::max(longest_step_, length);
  const bool shrinks = outcome_.iterations < kStepsToShrink || length < kShrunk * longest_step_;
  if (indefinite_ || !shrinks) return false;
  before_ = std::exchange(state_, moved(1));
  if (!gap_.empty()) {
    apply(mechanics_.constraints(), mechanics_.body(), state_, state_.displacement);
    gap_.clear();
  }
  return true;
}

double Solver::forcing() const {
  const double largest = full() ? kLooseForcing : kLargestForcing;
  const double last = last_forcing();
  // With the same tangent the model is as good as it was; a new one squares its error.
  const double expected = tangent_kept_ ? kept_.model_error : kept_.model_error * kept_.model_error;
  if (outcome_.iterations > 0 && expected <= last) return last;
  const double trusted = outcome_.iterations == 0 ? kFirstForcing : std::min(largest, kept_.model_error);
  return std::max(trusted, last);
}

// Relative residual of a linear solution that suffices for this iteration to be the last one.
double Solver::last_forcing() const {
  return std::min(0.3 * options_.tolerance * scale_ / residual_norm_, kLargestForcing);
}

void Solver::begin() {
  gap_ = state_.displacement;
  apply(mechanics_.constraints(), mechanics_.body(), state_, gap_);
  for (std::size_t e = 0; e < gap_.size(); ++e) gap_[e] -= state_.displacement[e];
  if (norm(gap_) == 0) gap_.clear();
  update_residual();
}

// In equilibrium, as well as the tolerance or rounding asks; makes the tangent where a new one is needed.
bool Solver::arrived() {
  const bool led = gap_.empty();
  if (led && (residual_norm_ <= options_.tolerance * scale_ || residual_norm_ == 0)) return true;
  const double keep_below = std::clamp(last_forcing(), kKeepTangentBelow, kKeepLastTangentBelow);
  tangent_kept_ = kept_.factored && led && kept_.model_error <= keep_below;
  if (tangent_kept_ || keeps_cells())
    before_.reset();
  else
    prepare_tangent(false);
  return led && residual_norm_ <= rounding_floor(mechanics_.tangent(), state_.displacement);
}

// Whether the cells' share of the tangent is kept; then that of effects has been made anew.
bool Solver::keeps_cells() {
  if (!kept_.factored || kept_.projected || !gap_.empty() ||
      !(kept_.model_error <= options_.keep_cells_below) || !mechanics_.renew_effects(state_))
    return false;
  kept_.factored = false;
  return true;
}

// One iteration. False when there is no step to take.
bool Solver::advance() {
  const bool led = gap_.empty();
  const std::vector<Vec3> rhs = right_hand_side();
  if (norm(rhs) > 0)
    solve_linear(rhs, forcing());
  else
    direction_.assign(rhs.size(), Vec3::Zero());
  if (outcome_.iterations == 0)
    for (const Vec3& step : direction_) outcome_.first_reach = std::max(outcome_.first_reach, step.norm());
  if (outcome_.first_reach > options_.farthest_reach) return false;
  // What the linear model predicts for the residual after a full step.
  std::vector<Vec3> predicted(rhs.size());
  if (kept_.factored) multiply(mechanics_.whole_tangent(), direction_, predicted);
  parallel_for_each(rhs.size(), [&](std::size_t e) { predicted[e] = rhs[e] - predicted[e]; });
  const double before = led ? residual_norm_ : norm(rhs);
  if (!(full() ? full_step() : led ? line_search(residual_) : lead_prescribed())) return false;
  const double reached = outcome_.relative_residual;
  update_residual();
  if (!sound_) {
    state_ = std::move(*before_);
    outcome_.relative_residual = reached;
    return false;
  }
  if (before > 0) {
    parallel_for_each(rhs.size(), [&](std::size_t e) { predicted[e] -= residual_[e]; });
    kept_.model_error = norm(predicted) / before;
  }
  progress_(way_gone(),
            fmt::format("newton {}, residual {:.1e}", outcome_.iterations + 1, outcome_.relative_residual));
  return true;
}

NewtonOutcome Solver::run() {
  begin();
  for (; outcome_.iterations < options_.max_iterations; ++outcome_.iterations) {
    if (arrived()) {
      outcome_.converged = !(full() && (kept_.projected || indefinite_));
      if (!outcome_.converged)
        outcome_.trouble = mechanics_.follows() ? "the equilibrium that was found may be unstable"
                                                : "the equilibrium that was found is unstable";
      return outcome_;
    }
    if (advance()) continue;
    if (!full() && gap_.empty() && outcome_.relative_residual <= 10 * options_.tolerance) break;
    outcome_.trouble = full() ? "full steps lead away from equilibrium"
                              : fmt::format("no step lowers the {} with every cell the right way round",
                                            mechanics_.follows() ? "forces that are left over" : "energy");
    return outcome_;
  }
  outcome_.converged = outcome_.relative_residual <= options_.tolerance;
  if (!outcome_.converged)
    outcome_.trouble = fmt::format("the residual stays at {:.1e} of the loads", outcome_.relative_residual);
  return outcome_;
}

}  // namespace

NewtonOutcome newton(Mechanics& mechanics, State& state, const NewtonOptions& options,
                     const NewtonProgress& progress, NewtonMemory* memory) {
  return Solver(mechanics, state, options, progress, memory).run();
}

NodeGeometry node_geometry(const Body& body, const State& state) {
  NodeGeometry geometry;
  geometry.position = body.rest;
  for (std::size_t e = 0; e < body.element_count(); ++e) geometry.position[e] += state.displacement[e];
  geometry.index = body.lattice_index;
  geometry.part = element_parts(body);
  return geometry;
}

}  // namespace flexel::simulate
