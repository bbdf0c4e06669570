// SNES asks for residuals, tangents and steps; each is made here as simulate/equilibrium/newton.cpp makes it. SNES solves
// K y = f for the step -y, where f is minus the force on free components and 0 on prescribed ones. What those still have to go
// is no part of the system: their way pulls at the right-hand side, and is taken with the step.
#include "distributed/newton_snes.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/stop.h"

namespace flexel::distributed {
namespace {

using simulate::NewtonOptions;
using simulate::NewtonOutcome;
using simulate::NewtonProgress;
using simulate::NewtonSteps;

// As in simulate/equilibrium/newton.cpp
constexpr double kFirstForcing = 1e-4, kLargestForcing = 0.1, kLooseForcing = 1e-3;
constexpr double kKeepTangentBelow = 1e-3, kKeepLastTangentBelow = 1e-2;
constexpr double kArmijo = 1e-4, kSmallestStep = 1.0 / 4096, kShrunk = 0.25;
constexpr int kMaxCgIterations = 3000, kMaxCgOfFullStep = 400, kMoreCgOfProjected = 40,
              kIterationsOfARefresh = 10;
constexpr int kStepsToShrink = 8;
constexpr int kMaxCgOfProjected = 400;  // of lowering steps: what is reached by then lowers the energy too
constexpr PetscInt kAskEvery = 8;       // iterations of conjugate gradients between two looks at the clock

}  // namespace

struct NewtonSnes::Calls {
  // An exception must not cross PETSc's frames.
  template <class Call>
  static PetscErrorCode guarded(void* context, const Call& call) {
    auto& self = *static_cast<NewtonSnes*>(context);
    try {
      call(self);
      return 0;
    } catch (...) {
      if (!self.error_) self.error_ = std::current_exception();
      return PETSC_ERR_LIB;
    }
  }
  static PetscErrorCode function(SNES, Vec at, Vec value, void* context) {
    return guarded(context, [&](NewtonSnes& self) { self.residual(at, value); });
  }
  static PetscErrorCode jacobian(SNES, Vec at, Mat, Mat, void* context) {
    return guarded(context, [&](NewtonSnes& self) { self.linearise(at); });
  }
  static PetscErrorCode before_linear(KSP, Vec right, Vec, void* context) {
    return guarded(context, [&](NewtonSnes& self) { self.before_linear(right); });
  }
  static PetscErrorCode line_search(SNESLineSearch search, void* context) {
    return guarded(context, [&](NewtonSnes& self) {
      Vec at, value, way;
      ok(SNESLineSearchGetVecs(search, &at, &value, &way, nullptr, nullptr));
      const bool found = self.step(at, value, way);
      if (found) ok(SNESLineSearchComputeNorms(search));
      ok(SNESLineSearchSetReason(search, found ? SNES_LINESEARCH_SUCCEEDED : SNES_LINESEARCH_FAILED_REDUCT));
    });
  }
  static PetscErrorCode judge(SNES, PetscInt, PetscReal, PetscReal, PetscReal value,
                              SNESConvergedReason* reason, void* context) {
    return guarded(context, [&](NewtonSnes& self) { *reason = self.judge(value); });
  }
  static PetscErrorCode judge_linear(KSP solver, PetscInt iteration, PetscReal value,
                                     KSPConvergedReason* reason, void* context) {
    return guarded(context, [&](NewtonSnes& self) {
      *reason = self.judge_linear(solver, static_cast<int>(iteration), value);
    });
  }
  static PetscErrorCode precondition(PC preconditioner, Vec residual, Vec correction) {
    void* context = nullptr;
    if (const PetscErrorCode code = PCShellGetContext(preconditioner, &context)) return code;
    return guarded(context, [&](NewtonSnes& self) { self.hierarchy_.apply(residual, correction); });
  }
};

NewtonSnes::NewtonSnes(PieceSystem& system) : system_(system), hierarchy_(system) {
  for (Vector* each : {&work_.inner, &work_.of_effects, &work_.gap, &work_.pulled, &work_.right_hand_side,
                       &work_.trial, &work_.before})
    *each = system.vector();
  ok(SNESCreate(PETSC_COMM_WORLD, snes_.fill()));
  Vector residual_vector = system.vector();
  ok(SNESSetFunction(snes_, residual_vector, Calls::function, this));
  ok(SNESSetJacobian(snes_, system.matrix(), system.matrix(), Calls::jacobian, this));
  KSP solver;
  ok(SNESGetKSP(snes_, &solver));
  ok(KSPSetType(solver, KSPCG));
  ok(KSPSetNormType(solver, KSP_NORM_UNPRECONDITIONED));
  ok(KSPSetPreSolve(solver, Calls::before_linear, this));
  PC preconditioner;
  ok(KSPGetPC(solver, &preconditioner));
  ok(PCSetType(preconditioner, PCSHELL));
  ok(PCShellSetContext(preconditioner, this));
  ok(PCShellSetApply(preconditioner, Calls::precondition));
  ok(PCShellSetName(preconditioner, "Flexel's hierarchy on the elements, PETSc's below (-coarse_)"));
  try {
    ok(SNESSetFromOptions(snes_));
  } catch (const std::runtime_error& error) {
    throw InputError(std::string("--petsc: ") + error.what());
  }
  ok(KSPSetConvergenceTest(solver, Calls::judge_linear, this, nullptr));
  steps_are_ours();
}

// After the options, of which some would take a step, or an end, that nothing here judges.
void NewtonSnes::steps_are_ours() {
  ok(SNESSetType(snes_, SNESNEWTONLS));
  ok(SNESSetConvergenceTest(snes_, Calls::judge, this, nullptr));
  SNESLineSearch search;
  ok(SNESGetLineSearch(snes_, &search));
  ok(SNESLineSearchSetType(search, SNESLINESEARCHSHELL));
  ok(SNESLineSearchShellSetUserFunc(search, Calls::line_search, this));
}

bool NewtonSnes::agree_to_stop() {
  int stop = memory_.stopped || (rank() == 0 && stop_is_due());
  ok(MPI_Bcast(&stop, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  memory_.stopped = stop != 0;
  return memory_.stopped;
}

// `linear`: relative residual of the linear solution that goes on; 1: none does.
void NewtonSnes::tell(double linear) {
  if (!progress_) return;
  const double whole = std::log(options_.tolerance);
  const auto way = [&](double left) { return std::log(std::clamp(left, options_.tolerance, 1.0)) / whole; };
  const double gone = way(outcome_.relative_residual);
  const std::string note =
      linear < 1 ? fmt::format("newton {}, linear {:.0e}", outcome_.iterations + 1, linear)
                 : fmt::format("newton {}, residual {:.1e}", outcome_.iterations, outcome_.relative_residual);
  (*progress_)(std::min(1.0, gone + (linear < 1 ? way(linear) / 2 : 0)), note);
}

void NewtonSnes::put_prescribed(Vec displacement) {
  ok(VecPointwiseMult(displacement, displacement, system_.free()));
  ok(VecPointwiseMult(work_.trial, prescribed_, system_.free()));
  ok(VecAYPX(work_.trial, -1, prescribed_));  // what is prescribed, elsewhere 0
  ok(VecAXPY(displacement, 1, work_.trial));
}

void NewtonSnes::begin(Vec displacement, Vec prescribed) {
  prescribed_ = prescribed;
  memory_ = {};
  outcome_ = {};
  error_ = nullptr;
  ok(VecCopy(displacement, work_.gap));
  put_prescribed(work_.gap);
  ok(VecAXPY(work_.gap, -1, displacement));
  memory_.led = norm(work_.gap) == 0;
}

void NewtonSnes::residual(Vec displacement, Vec negative) {
  system_.forces(displacement, outer_, work_.inner, work_.of_effects);
  ok(VecPointwiseMult(negative, work_.inner, system_.free()));
  const double free_inner = norm(negative), inner = norm(work_.inner), outer = norm(work_.of_effects);
  // Of inner forces, those on prescribed components; as a difference it may lose digits, but not beside `outer`.
  ok(VecWAXPY(work_.trial, -1, negative, work_.inner));
  const double held = norm(work_.trial);
  memory_.scale = std::max(std::sqrt(outer * outer + held * held), options_.least_scale);
  if (!std::isfinite(memory_.scale) || !std::isfinite(inner) || !std::isfinite(free_inner))
    memory_.scale = std::numeric_limits<double>::quiet_NaN();
  ok(VecWAXPY(negative, 1, work_.of_effects, work_.inner));
  ok(VecPointwiseMult(negative, negative, system_.free()));
  ok(VecScale(negative, -1));
}

double NewtonSnes::last_forcing() const {
  return std::min(0.3 * options_.tolerance * memory_.scale / memory_.residual_norm, kLargestForcing);
}

double NewtonSnes::forcing() const {
  const double largest = full() ? kLooseForcing : kLargestForcing, last = last_forcing();
  const double expected = memory_.kept ? memory_.model_error : memory_.model_error * memory_.model_error;
  if (outcome_.iterations > 0 && expected <= last) return last;
  const double trusted = outcome_.iterations == 0 ? kFirstForcing : std::min(largest, memory_.model_error);
  return std::max(trusted, last);
}

void NewtonSnes::linearise(Vec displacement) {
  const double keep_below = std::clamp(last_forcing(), kKeepTangentBelow, kKeepLastTangentBelow);
  memory_.kept =
      memory_.factored && !memory_.project_next && memory_.led && memory_.model_error <= keep_below;
  if (!memory_.kept) {
    std::vector<Mat3> stress;
    if (memory_.stepped) stress = system_.predicted_stress(work_.before, displacement);
    system_.assemble(displacement, {memory_.project_next, memory_.stepped ? &stress : nullptr},
                     memory_.led ? nullptr : static_cast<Vec>(work_.gap), work_.pulled);
    memory_.projected = memory_.project_next;
    memory_.factored = true;
    refresh_hierarchy(displacement);
  }
  memory_.stepped = memory_.project_next = false;
}

// Nothing where an option has put another preconditioner in its place.
void NewtonSnes::refresh_hierarchy(Vec displacement) {
  KSP solver;
  PC preconditioner;
  PetscBool ours = PETSC_FALSE;
  ok(SNESGetKSP(snes_, &solver));
  ok(KSPGetPC(solver, &preconditioner));
  ok(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(preconditioner), PCSHELL, &ours));
  if (!ours) return;
  if (memory_.asks && hierarchy_.made())
    hierarchy_.refresh_smoother();
  else
    hierarchy_.refresh(displacement);
}

void NewtonSnes::before_linear(Vec right_hand_side) {
  if (memory_.asks) {
    memory_.right_norm = norm(right_hand_side);
    return;
  }
  if (!memory_.led) {
    ok(VecPointwiseMult(work_.pulled, work_.pulled, system_.free()));
    ok(VecAXPY(right_hand_side, 1, work_.pulled));
  }
  memory_.right_norm = norm(right_hand_side);
  ok(VecCopy(right_hand_side, work_.right_hand_side));
  KSP solver;
  ok(SNESGetKSP(snes_, &solver));
  const double enough =
      memory_.led || memory_.right_norm == 0
          ? forcing()
          : std::max(kFirstForcing, std::min(0.3 * options_.tolerance * memory_.scale / memory_.right_norm,
                                             kLargestForcing));
  const bool bounded = memory_.projected;
  // Where rounding makes a projected tangent indefinite, what was reached before lowers the energy still.
  ok(SNESSetMaxLinearSolveFailures(snes_, bounded && !full() ? PETSC_MAX_INT : 1));
  memory_.most = !full()   ? bounded ? kMaxCgOfProjected : kMaxCgIterations
                 : bounded ? std::min(kMaxCgOfFullStep, 4 * memory_.usual + kMoreCgOfProjected)
                           : kMaxCgOfFullStep;
  ok(KSPSetTolerances(solver, enough, 0, PETSC_DEFAULT, kMaxCgIterations + 1));
}

// Whether a projected tangent of full steps will take too many iterations: a smaller load is cheaper then.
bool NewtonSnes::hopeless(int iteration, double gone, double tolerance) const {
  if (memory_.asks || !full() || !memory_.projected || iteration < 2 * memory_.usual + kIterationsOfARefresh)
    return false;
  const double gained = std::max(1e-3, -std::log10(gone));
  return iteration * std::max(0.0, -std::log10(tolerance) / gained - 1) > memory_.most;
}

// Where a full step takes too many iterations its tangent has become nearly singular. Of other steps what they have reached is taken.
KSPConvergedReason NewtonSnes::judge_linear(KSP solver, int iteration, double value) {
  double tolerance = 0;
  ok(KSPGetTolerances(solver, &tolerance, nullptr, nullptr, nullptr));
  memory_.last = iteration;
  if (std::isnan(value)) return KSP_DIVERGED_NANORINF;
  if (value <= tolerance * memory_.right_norm) {
    const double decades = std::max(1.0, -std::log10(tolerance));
    if (memory_.usual == 0 && !memory_.asks)
      memory_.usual = std::max(1, static_cast<int>(std::lround(4 * iteration / decades)));
    return KSP_CONVERGED_RTOL;
  }
  if (iteration >= memory_.most) return full() || memory_.asks ? KSP_DIVERGED_ITS : KSP_CONVERGED_ITS;
  if (iteration == 0 || iteration % kAskEvery != 0) return KSP_CONVERGED_ITERATING;
  tell(value / memory_.right_norm);
  if (hopeless(iteration, value / memory_.right_norm, tolerance)) return KSP_DIVERGED_ITS;
  return agree_to_stop() ? KSP_DIVERGED_BREAKDOWN : KSP_CONVERGED_ITERATING;
}

double NewtonSnes::rounding_floor(Vec displacement) {
  if (!memory_.factored) return 0;
  ok(MatGetDiagonal(system_.matrix(), work_.trial));
  ok(VecPointwiseMult(work_.trial, work_.trial, displacement));
  return 16 * std::numeric_limits<double>::epsilon() * norm(work_.trial);
}

SNESConvergedReason NewtonSnes::judge(double residual_norm) {
  memory_.residual_norm = residual_norm;
  outcome_.relative_residual = memory_.scale == 0 ? 0 : residual_norm / memory_.scale;
  tell(1);
  if (agree_to_stop()) return SNES_DIVERGED_INNER;
  if (memory_.led && (residual_norm <= options_.tolerance * memory_.scale || residual_norm == 0 ||
                      residual_norm <= rounding_floor(now_)))
    return SNES_CONVERGED_FNORM_ABS;
  return outcome_.iterations >= options_.max_iterations ? SNES_DIVERGED_MAX_IT : SNES_CONVERGED_ITERATING;
}

// m: how far the linear answer moves a free element at most.
double NewtonSnes::reach_of(Vec way) {
  const double* values = nullptr;
  PetscInt own = 0;
  ok(VecGetLocalSize(way, &own));
  ok(VecGetArrayRead(way, &values));
  double most = 0, all = 0;
  for (PetscInt i = 0; i + 2 < own; i += 3) most = std::max(most, Eigen::Map<const Vec3>(values + i).norm());
  ok(VecRestoreArrayRead(way, &values));
  ok(MPI_Allreduce(&most, &all, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  return all;
}

// One step along -`way`; `displacement` and `negative`, its residual, become those at its end. False where there is none.
bool NewtonSnes::step(Vec displacement, Vec negative, Vec way) {
  // Conjugate gradients leave the prescribed components at zero up to their tolerance only.
  ok(VecPointwiseMult(way, way, system_.free()));
  if (outcome_.iterations == 0) outcome_.first_reach = reach_of(way);
  if (outcome_.first_reach > options_.farthest_reach) return false;
  // What the linear model leaves over.
  Vector left = system_.vector();
  ok(MatMult(system_.matrix(), way, left));
  ok(VecAYPX(left, -1, work_.right_hand_side));
  const bool was_led = memory_.led;
  const double before = was_led ? memory_.residual_norm : memory_.right_norm;
  if (!(full()    ? full_step(displacement, way)
        : was_led ? lower_energy(displacement, negative, way)
                  : lead_prescribed(displacement, way)))
    return false;
  ++outcome_.iterations;
  residual(displacement, negative);
  if (before > 0) {
    ok(VecAXPY(left, -1, negative));
    memory_.model_error = norm(left) / before;
  }
  return true;
}

bool NewtonSnes::full_step(Vec displacement, Vec way) {
  if (!memory_.led) ok(VecAXPY(way, -1, work_.gap));
  const double length = norm(way);
  memory_.longest_step = std::max(memory_.longest_step, length);
  const bool shrinks = outcome_.iterations < kStepsToShrink || length < kShrunk * memory_.longest_step;
  if (!shrinks) return false;
  ok(VecWAXPY(work_.trial, -1, way, displacement));
  if (!std::isfinite(system_.energy(work_.trial, outer_))) return false;
  ok(VecCopy(displacement, work_.before));
  memory_.stepped = true;
  ok(VecCopy(work_.trial, displacement));
  if (!memory_.led) put_prescribed(displacement);
  memory_.led = true;
  return true;
}

// As much of the way as every cell bears: energy is no guide here.
bool NewtonSnes::lead_prescribed(Vec displacement, Vec way) {
  ok(VecAXPY(way, -1, work_.gap));
  for (double share = 1; share >= kSmallestStep; share /= 2) {
    ok(VecWAXPY(work_.trial, -share, way, displacement));
    if (!std::isfinite(system_.energy(work_.trial, outer_))) continue;
    ok(VecCopy(work_.trial, displacement));
    ok(VecScale(work_.gap, 1 - share));
    memory_.led = share == 1;
    if (memory_.led) put_prescribed(displacement);
    return true;
  }
  return false;
}

bool NewtonSnes::lower_energy(Vec displacement, Vec negative, Vec way) {
  double slope = 0;
  ok(VecDot(negative, way, &slope));
  slope = -slope;
  if (!(slope < 0)) return false;
  const double before = system_.energy(displacement, outer_), noise = 1e-12 * std::abs(before);
  Vector trial = system_.vector(), forces = system_.vector();
  for (double share = 1; share >= kSmallestStep; share /= 2) {
    ok(VecWAXPY(trial, -share, way, displacement));
    const double after = system_.energy(trial, outer_);
    if (!std::isfinite(after)) continue;
    bool accepted = after <= before + kArmijo * share * slope;
    if (!accepted && after <= before + noise) {
      // Near the minimum the energy no longer has the digits; the forces do.
      residual(trial, forces);
      accepted = norm(forces) < 0.9 * memory_.residual_norm;
    }
    if (!accepted) continue;
    ok(VecCopy(trial, displacement));
    return true;
  }
  return false;
}

void NewtonSnes::say_trouble(SNESConvergedReason reason) {
  const bool reached = reason > 0;
  outcome_.converged = reached && !(full() && memory_.projected);
  if (outcome_.converged) return;
  if (reached)
    outcome_.trouble = "the equilibrium that was found is unstable";
  else if (reason == SNES_DIVERGED_MAX_IT)
    outcome_.trouble = fmt::format("the residual stays at {:.1e} of the loads", outcome_.relative_residual);
  else if (reason == SNES_DIVERGED_LINEAR_SOLVE)
    outcome_.trouble = "PETSc's conjugate gradients do not arrive";
  else
    outcome_.trouble = full() ? "full steps lead away from equilibrium"
                              : "no step lowers the energy with every cell the right way round";
}

NewtonOutcome NewtonSnes::solve(Vec displacement, Vec outer, Vec prescribed, const NewtonOptions& options,
                                const NewtonProgress* progress) {
  const StopWaits together;  // the ranks agree to stop, in agree_to_stop()
  options_ = options;
  progress_ = progress;
  outer_ = outer;
  now_ = displacement;
  begin(displacement, prescribed);
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
  PetscInt linear_iterations = 0;
  const auto began = std::chrono::steady_clock::now();
  for (;;) {
    ok(SNESSetTolerances(snes_, 0, 0, 0, std::max(1, options.max_iterations), PETSC_MAX_INT));
    const PetscErrorCode failed = SNESSolve(snes_, nullptr, displacement);
    if (error_) std::rethrow_exception(error_);
    ok(failed);
    ok(SNESGetConvergedReason(snes_, &reason));
    PetscInt more = 0;
    ok(SNESGetLinearSolveIterations(snes_, &more));
    linear_iterations += more;
    // A tangent that is not positive is taken again from the positive parts of the cells'.
    if (reason != SNES_DIVERGED_LINEAR_SOLVE || memory_.projected || memory_.stopped) break;
    memory_.project_next = true;
  }
  outcome_.linear_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  outcome_.cg_iterations = static_cast<int>(linear_iterations);
  say_trouble(reason);
  return outcome_;
}

std::optional<bool> NewtonSnes::has_positive_tangent(Vec displacement) {
  constexpr double kTolerance = 1e-6;
  constexpr int kIterations = 1000;
  const StopWaits together;
  progress_ = nullptr;
  error_ = nullptr;
  memory_ = {};
  memory_.asks = true;
  memory_.most = kIterations;
  if (agree_to_stop()) return std::nullopt;
  system_.assemble(displacement, {}, nullptr, nullptr);
  refresh_hierarchy(displacement);
  PetscInt first = 0, end = 0;
  ok(VecGetOwnershipRange(work_.right_hand_side, &first, &end));
  double* values = nullptr;
  ok(VecGetArray(work_.right_hand_side, &values));
  for (PetscInt i = first; i < end; ++i)
    values[i - first] = simulate::scattered(static_cast<std::uint64_t>(i));
  ok(VecRestoreArray(work_.right_hand_side, &values));
  ok(VecPointwiseMult(work_.right_hand_side, work_.right_hand_side, system_.free()));
  KSP solver;
  ok(SNESGetKSP(snes_, &solver));
  ok(KSPSetOperators(solver, system_.matrix(), system_.matrix()));
  ok(KSPSetTolerances(solver, kTolerance, 0, PETSC_DEFAULT, kIterations + 1));
  const PetscErrorCode failed = KSPSolve(solver, work_.right_hand_side, work_.trial);
  if (error_) std::rethrow_exception(error_);
  ok(failed);
  KSPConvergedReason reason;
  ok(KSPGetConvergedReason(solver, &reason));
  if (reason == KSP_DIVERGED_INDEFINITE_MAT) return false;
  return reason > 0 ? std::optional(true) : std::nullopt;
}

}  // namespace flexel::distributed
