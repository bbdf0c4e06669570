// Preconditioned conjugate gradients (Hestenes and Stiefel 1952), the way a Newton method needs them (Dembo
// and Steihaug 1983): a direction of negative curvature ends the iteration with the step reached so far. The
// residual is updated by recursion; when it says "converged" the true residual is computed, and where
// rounding made the two differ the iteration restarts from the true one. For slender parts the smallest
// residual that double precision allows can lie above the tolerance; reaching it counts as converged.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/preconditioner.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

using Vector = std::vector<Vec3>;

// x += step direction, residual -= step image; returns the norm of the residual. In one go: these vectors are
// larger than a cache.
double advance(double step, const Vector& direction, const Vector& image, Vector& x, Vector& residual) {
  return std::sqrt(parallel_sum<double>(x.size(), [&](std::size_t i) {
    x[i] += step * direction[i];
    residual[i] -= step * image[i];
    return residual[i].squaredNorm();
  }));
}

// direction = correction + beta direction
void turn(const Vector& correction, double beta, Vector& direction) {
  parallel_for_each(correction.size(),
                    [&](std::size_t i) { direction[i] = correction[i] + beta * direction[i]; });
}

// residual = b - A x; returns its norm.
double true_residual(const LinearOperator& matrix, const Vector& b, const Vector& x, Vector& residual) {
  multiply(matrix, x, residual);
  parallel_for_each(b.size(), [&](std::size_t i) { residual[i] = b[i] - residual[i]; });
  return std::sqrt(dot(residual, residual));
}

// Size of the error that rounding alone leaves in b - A x (Rigal and Gaches 1967): eps | |A| |x| |.
double rounding_level(const LinearOperator& matrix, const Vector& x) {
  constexpr std::size_t kGrain = 256;
  const std::size_t chunks = (matrix.rows() + kGrain - 1) / kGrain;
  const double squared = parallel_sum<double>(
      chunks,
      [&](std::size_t chunk) {
        const std::size_t begin = chunk * kGrain, end = std::min(matrix.rows(), begin + kGrain);
        thread_local std::vector<Block> room;
        const Block* block = matrix.blocks(begin, end, room);
        double sum_of_squares = 0;
        for (std::size_t row = begin; row < end; ++row) {
          Vec3 sum = Vec3::Zero();
          for (std::uint64_t q = matrix.row_offsets()[row]; q < matrix.row_offsets()[row + 1]; ++q)
            sum.noalias() += (block++)->cwiseAbs() * x[matrix.columns()[q]].cwiseAbs();
          sum_of_squares += sum.squaredNorm();
        }
        return sum_of_squares;
      },
      1);
  return std::numeric_limits<double>::epsilon() * std::sqrt(squared);
}

}  // namespace

LinearResult conjugate_gradients(const LinearOperator& matrix, const Vector& b, Vector& x,
                                 const Preconditioner& preconditioner, double tolerance, int max_iterations,
                                 const std::function<void(int, double)>& progress,
                                 const std::function<bool(int, double)>& hopeless) {
  LinearResult result;
  x.assign(b.size(), Vec3::Zero());
  const double scale = std::sqrt(dot(b, b));
  if (scale == 0) {
    result.converged = true;
    return result;
  }
  Vector residual = b, correction, direction(b.size(), Vec3::Zero()), image;
  double rz = 0, norm = scale, checked = std::numeric_limits<double>::infinity();
  bool restart = true, known = false;  // known: `norm` is that of b - A x
  while (result.iterations < max_iterations && std::isfinite(norm)) {
    preconditioner.apply(residual, correction);
    const double rz_before = rz;
    rz = dot(residual, correction);
    if (!(rz > 0)) break;
    turn(correction, restart ? 0 : rz / rz_before, direction);
    restart = false;
    multiply(matrix, direction, image);
    const double curvature = dot(direction, image);
    if (!(curvature > 0)) {
      result.indefinite = curvature <= 0;
      if (result.indefinite && result.iterations == 0) x = direction;
      break;
    }
    norm = advance(rz / curvature, direction, image, x, residual);
    known = false;
    ++result.iterations;
    if (progress) progress(result.iterations, norm / scale);
    if (norm > tolerance * scale) {
      if (hopeless && hopeless(result.iterations, norm / scale)) break;
      continue;
    }
    norm = true_residual(matrix, b, x, residual);
    known = true;
    result.converged = norm <= tolerance * scale || norm <= rounding_level(matrix, x);
    // Another round only while it still helps: rounding sets a floor to the true residual.
    if (result.converged || norm > .5 * checked) break;
    checked = norm;
    restart = true;
  }
  result.relative_residual = (known ? norm : true_residual(matrix, b, x, residual)) / scale;
  return result;
}

LinearResult conjugate_gradients(const BlockMatrix& matrix, const Vector& b, Vector& x,
                                 const Preconditioner& preconditioner, double tolerance, int max_iterations,
                                 const std::function<void(int, double)>& progress) {
  return conjugate_gradients(StoredMatrix(matrix), b, x, preconditioner, tolerance, max_iterations, progress);
}

}  // namespace flexel::simulate
