// Smoothed-aggregation multigrid.
#pragma once
#include <memory>

#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

constexpr std::size_t kDirectRows = 1000;  // elements; a matrix up to this size is factorised at once

// Smoothed aggregation with six rigid motions an aggregate (Vanek, Mandel, Brezina 1996; notes in
// docs/theory/solver.md): the paper's reduction of a group of elements to one (section 3.1), with its rotation. A
// direct factorisation up to `direct_rows` elements. Keeps a reference to `matrix`.
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const LinearOperator& matrix,
                                                                    const NodeGeometry& geometry,
                                                                    std::size_t direct_rows = kDirectRows);
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const BlockMatrix& matrix,
                                                                    const NodeGeometry& geometry);

}  // namespace flexel::simulate
