// The simplest preconditioner.
#pragma once
#include <memory>

#include "simulate/linear/preconditioner.h"

namespace flexel::simulate {

// Inverse of the diagonal blocks (small eigenvalues dropped).
[[nodiscard]] std::unique_ptr<Preconditioner> block_jacobi(const BlockMatrix& matrix);

}  // namespace flexel::simulate
