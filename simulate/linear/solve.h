// Solves the linear systems of Newton's method: conjugate gradients with block Jacobi or smoothed-aggregation
// multigrid.
#pragma once
#include <functional>
#include <memory>

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

// Inverse of the diagonal blocks (small eigenvalues dropped).
[[nodiscard]] std::unique_ptr<Preconditioner> block_jacobi(const BlockMatrix& matrix);

// Smoothed aggregation with six rigid motions an aggregate (Vanek, Mandel, Brezina 1996; notes in
// docs/theory/solver.md): the paper's reduction of a group of elements to one (section 3.1), with its rotation. A
// direct factorisation where the matrix is small. Keeps a reference to `matrix`.
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const LinearOperator& matrix,
                                                                    const NodeGeometry& geometry);
[[nodiscard]] std::unique_ptr<Preconditioner> aggregation_multigrid(const BlockMatrix& matrix,
                                                                    const NodeGeometry& geometry);

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

// Rigid motions that A leaves free: eigenvectors of A restricted to the six rigid motions of each connected
// group of unknowns, with an eigenvalue under `threshold` times that of a stiff one. For the message that
// names the part and the motion.
struct FreeMotion {
  std::uint32_t part = 0;
  Vec3 translation = Vec3::Zero();  // unit direction, or zero
  Vec3 rotation = Vec3::Zero();     // unit axis, or zero
};
[[nodiscard]] std::vector<FreeMotion> free_motions(const LinearOperator& matrix, const NodeGeometry& geometry,
                                                   double threshold = 1e-9);
[[nodiscard]] std::vector<FreeMotion> free_motions(const BlockMatrix& matrix, const NodeGeometry& geometry,
                                                   double threshold = 1e-9);

}  // namespace flexel::simulate
