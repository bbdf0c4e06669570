// Newton's method for one load share.
#pragma once
#include <functional>
#include <limits>
#include <string>

#include "simulate/equilibrium/mechanics.h"
#include "simulate/linear/free_motions.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

// How far a step goes. `full`: all the way, whatever the energy does in between; fast, also where a part
// bends past its thickness, but it can run away. `lowering`: as far as the energy falls; slow, hardly ever
// fails.
enum class NewtonSteps { full, lowering };

struct NewtonOptions {
  NewtonSteps steps = NewtonSteps::lowering;
  double tolerance = 1e-8;  // residual relative to loads and reactions
  int max_iterations = 40;
  double least_scale = 0;  // N, that the residual is measured against at least
  DirectLimit direct;      // of aggregation_multigrid()
  bool unstressed =
      false;  // the first tangent has no geometric stiffness: the linear answer of unstressed matter
  // Of the last step: below it the cells' share of the tangent is kept, and that of effects alone made anew.
  double keep_cells_below = 0;
  // m: a first linear answer that reaches further ends the attempt
  double farthest_reach = std::numeric_limits<double>::infinity();
};

// What one solution may leave to the next, of the same mechanics nearby: the tangent, eliminated, in
// Mechanics::tangent() and its preconditioner. Empty: everything is made anew.
struct NewtonMemory {
  std::unique_ptr<Preconditioner> preconditioner;
  // the preconditioner is that of the matrix, whose prescribed components are eliminated
  bool factored = false;
  bool stale = false;        // its coarser levels are of an earlier tangent
  bool outdated = false;     // and too far from it: they are made from the next one
  int usual_iterations = 0;  // of conjugate gradients to 1e-4 with a preconditioner made anew
  double model_error = 1;    // of the last step, relative
  bool projected = false;    // the tangent's indefinite cells were made positive
};

struct NewtonOutcome {
  bool converged = false;
  int iterations = 0, cg_iterations = 0;
  double relative_residual = 1;
  double linear_seconds = 0;  // in preconditioners and conjugate gradients
  double first_reach = 0;     // m: largest displacement of the first linear answer
  std::string trouble;        // why it stopped when not converged
};

// Hears how much of the way to the tolerance is gone, in [0, 1], by the logarithm of the residual, and a note. May throw.
using NewtonProgress = std::function<void(double, const std::string&)>;

// Moves `state` to the equilibrium at its share. On failure the state is what was reached: the caller keeps
// its own copy. `progress` hears of every iteration. `memory`: from one solution to the next.
[[nodiscard]] NewtonOutcome newton(Mechanics& mechanics, State& state, const NewtonOptions& options,
                                   const NewtonProgress& progress, NewtonMemory* memory = nullptr);

// Geometry of the unknowns at `state`, for the preconditioner and for free_motions().
[[nodiscard]] NodeGeometry node_geometry(const Body& body, const State& state);

}  // namespace flexel::simulate
