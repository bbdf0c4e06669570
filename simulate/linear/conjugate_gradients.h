// Preconditioned conjugate gradients for the linear systems of Newton's method.
#pragma once
#include <functional>
#include <vector>

#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

struct LinearResult {
  int iterations = 0;
  double relative_residual = 0;  // |b - A x| / |b|
  // The relative residual is at most the tolerance, or as small as rounding lets it be: |b - A x| <= eps |
  // |A| |x| |. That is 1e-6 for a plate one cell thick and 450 long, 1e-9 for a solid part.
  bool converged = false;
  // A direction of negative curvature was met; x is what was reached before it, or that direction itself
  // (which ascends along b; its length means nothing) where it was the very first.
  bool indefinite = false;
};

// Preconditioned conjugate gradients from x = 0. `progress` is called with every iteration and its relative
// residual; it may throw to interrupt. `hopeless` is asked likewise and ends the iteration where it says so.
[[nodiscard]] LinearResult conjugate_gradients(const LinearOperator& matrix, const std::vector<Vec3>& b,
                                               std::vector<Vec3>& x, const Preconditioner& preconditioner,
                                               double tolerance, int max_iterations,
                                               const std::function<void(int, double)>& progress = {},
                                               const std::function<bool(int, double)>& hopeless = {});
[[nodiscard]] LinearResult conjugate_gradients(const BlockMatrix& matrix, const std::vector<Vec3>& b,
                                               std::vector<Vec3>& x, const Preconditioner& preconditioner,
                                               double tolerance, int max_iterations,
                                               const std::function<void(int, double)>& progress = {});

}  // namespace flexel::simulate
