// Smoothed-aggregation multigrid.
#pragma once
#include <memory>

#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

// A matrix within either is factorised at once.
struct DirectLimit {
  std::size_t rows = 1000;  // elements
  double row_cost = 0;      // multiplications of the factorisation an element; 0: they are not counted
};

// Smoothed aggregation with six rigid motions an aggregate (Vanek, Mandel, Brezina 1996; notes in
// docs/theory/solver.md): the paper's reduction of a group of elements to one (section 3.1), with its rotation. A
// direct factorisation within `direct`. Keeps a reference to `matrix`.
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const LinearOperator& matrix,
                                                                    const NodeGeometry& geometry,
                                                                    const DirectLimit& direct = {});
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const BlockMatrix& matrix,
                                                                    const NodeGeometry& geometry,
                                                                    const DirectLimit& direct = {});

}  // namespace flexel::simulate
