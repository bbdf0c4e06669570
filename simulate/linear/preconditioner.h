// What preconditions conjugate gradients.
#pragma once
#include <vector>

#include "simulate/linear/operator.h"

namespace flexel::simulate {

// What the multigrid hierarchy needs to know of the unknowns besides the matrix.
struct NodeGeometry {
  std::vector<Vec3> position;       // (rows x 3) m
  std::vector<Index3> index;        // (rows x 3) lattice index, for the blocks of the aggregation
  std::vector<std::uint32_t> part;  // (rows) elements of different parts never share an aggregate
};

// Approximates A^-1. apply() is deterministic for any thread count, symmetric and positive definite; it uses
// memory of its own, so one call at a time. Keeps a reference to the matrix that it was made for.
class Preconditioner {
 public:
  virtual ~Preconditioner() = default;
  virtual void apply(const std::vector<Vec3>& residual, std::vector<Vec3>& correction) const = 0;
  // Takes up new values of the matrix (Newton's next tangent), whose pattern must be the one it was made for.
  // Cheaper than a new preconditioner: what depends on the pattern alone is kept.
  virtual void refresh() = 0;
  // Likewise, but what the coarser levels know of the matrix stays: a fraction of the time, and more
  // iterations the more it has changed.
  virtual void refresh_smoother() { refresh(); }
};

}  // namespace flexel::simulate
