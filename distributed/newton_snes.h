// Newton's method for one load step on all ranks: PETSc's SNES with conjugate gradients and distributed/hierarchy.h, with the steps, the
// forcing and the criteria of simulate/equilibrium/newton.cpp.
#pragma once
#include <exception>
#include <optional>

#include "distributed/hierarchy.h"
#include "simulate/equilibrium/newton.h"

namespace flexel::distributed {

class NewtonSnes {
 public:
  explicit NewtonSnes(PieceSystem& system);
  NewtonSnes(const NewtonSnes&) = delete;
  NewtonSnes& operator=(const NewtonSnes&) = delete;

  // Moves `displacement` [m] to equilibrium under `outer` [N], prescribed components to `prescribed` [m]. By all ranks together.
  // `progress`: on rank 0; null elsewhere. What stops the run (base/stop.h) on rank 0 ends the solution on all: not converged.
  [[nodiscard]] simulate::NewtonOutcome solve(Vec displacement, Vec outer, Vec prescribed,
                                              const simulate::NewtonOptions& options,
                                              const simulate::NewtonProgress* progress);
  // simulate/equilibrium/positive_tangent.h, by all ranks together.
  [[nodiscard]] std::optional<bool> has_positive_tangent(Vec displacement);

 private:
  struct Calls;  // what PETSc calls back

  [[nodiscard]] bool full() const { return options_.steps == simulate::NewtonSteps::full; }
  void steps_are_ours();
  void begin(Vec displacement, Vec prescribed);
  void residual(Vec displacement, Vec negative);
  void linearise(Vec displacement);
  void before_linear(Vec right_hand_side);
  [[nodiscard]] KSPConvergedReason judge_linear(KSP solver, int iteration, double value);
  [[nodiscard]] bool hopeless(int iteration, double gone, double tolerance) const;
  void refresh_hierarchy(Vec displacement);
  [[nodiscard]] SNESConvergedReason judge(double residual_norm);
  [[nodiscard]] bool step(Vec displacement, Vec negative, Vec way);
  [[nodiscard]] bool full_step(Vec displacement, Vec way);
  [[nodiscard]] bool lead_prescribed(Vec displacement, Vec way);
  [[nodiscard]] bool lower_energy(Vec displacement, Vec negative, Vec way);
  void put_prescribed(Vec displacement);
  [[nodiscard]] double reach_of(Vec way);
  [[nodiscard]] double last_forcing() const;
  [[nodiscard]] double forcing() const;
  [[nodiscard]] double rounding_floor(Vec displacement);
  [[nodiscard]] bool agree_to_stop();
  void tell(double linear);
  void say_trouble(SNESConvergedReason reason);

  PieceSystem& system_;
  Nonlinear snes_;
  Hierarchy hierarchy_;
  // work: forces, gap of prescribed components, what it pulls, right-hand side, trial, where the last full step began
  struct Work {
    Vector inner, of_effects, gap, pulled, right_hand_side, trial, before;
  } work_;
  Vec outer_ = nullptr, prescribed_ = nullptr, now_ = nullptr;  // of solve()
  simulate::NewtonOptions options_;
  const simulate::NewtonProgress* progress_ = nullptr;
  simulate::NewtonOutcome outcome_;
  struct Memory {
    bool led = true;  // prescribed components are where they are to be
    bool factored = false, kept = false, projected = false, project_next = false, stopped = false;
    bool stepped = false;               // `before` is set
    bool asks = false;                  // of has_positive_tangent()
    int most = 0, last = 0, usual = 0;  // iterations of conjugate gradients: allowed, taken, to 1e-4 at first
    double model_error = 1, scale = 0, residual_norm = 0, longest_step = 0, right_norm = 0;
  } memory_;
  std::exception_ptr error_;
};

}  // namespace flexel::distributed
