// Smoothed-aggregation multigrid.
#pragma once
#include <memory>

#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

// Smoothed aggregation with six rigid motions an aggregate (Vanek, Mandel, Brezina 1996; notes in
// docs/theory/solver.md): the paper's reduction of a group of elements to one (section 3.1), with its rotation. A
// direct factorisation where the matrix is small, or takes at most `factor_cost` multiplications a row (0: it is not looked at).
// Keeps a reference to `matrix`.
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const LinearOperator& matrix,
                                                                    const NodeGeometry& geometry,
                                                                    double factor_cost = 0);
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const BlockMatrix& matrix,
                                                                    const NodeGeometry& geometry,
                                                                    double factor_cost = 0);

}  // namespace flexel::simulate
