// The method of generalised minimal residuals, for matrices that are not symmetric.
#pragma once
#include "simulate/linear/conjugate_gradients.h"

namespace flexel::simulate {

// From x = 0, preconditioned from the right, so that the residual is the true one; starts anew every 40
// iterations, whose directions it keeps. `progress` and `hopeless` as for conjugate_gradients().
// `indefinite`: x . A x <= 0 at the end, which says that the symmetric part of A is not positive; that x
// is a solution all the same.
[[nodiscard]] LinearResult gmres(const LinearOperator& matrix, const std::vector<Vec3>& b,
                                 std::vector<Vec3>& x, const Preconditioner& preconditioner, double tolerance,
                                 int max_iterations, const std::function<void(int, double)>& progress = {},
                                 const std::function<bool(int, double)>& hopeless = {});

}  // namespace flexel::simulate
