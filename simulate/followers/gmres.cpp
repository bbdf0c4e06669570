// Saad and Schultz 1986, with modified Gram-Schmidt and Givens rotations (Saad, Iterative Methods for
// Sparse Linear Systems, 2003, algorithm 9.5).
#include "simulate/followers/gmres.h"

#include <Eigen/Core>
#include <Eigen/Jacobi>
#include <cmath>

#include "base/parallel.h"
#include "simulate/linear/vector_products.h"

namespace flexel::simulate {
namespace {

constexpr int kDirections = 40;    // that a cycle keeps
constexpr double kStalled = 0.95;  // of the residual is left after a cycle: there is no use in another
constexpr double kAgain = 0.5;     // likewise where the estimate said that it had arrived

using Vector = std::vector<Vec3>;

double norm(const Vector& a) {
  return std::sqrt(dot(a, a));
}

void add(double factor, const Vector& from, Vector& to) {
  parallel_for_each(to.size(), [&](std::size_t i) { to[i] += factor * from[i]; });
}

// One cycle from a residual: directions, the small least-squares problem, and the change of x.
class Cycle {
 public:
  Cycle(const LinearOperator& matrix, const Preconditioner& preconditioner, Vector residual, double length)
      : matrix_(matrix), preconditioner_(preconditioner), left_(Eigen::VectorXd::Zero(kDirections + 1)) {
    parallel_for_each(residual.size(), [&](std::size_t i) { residual[i] /= length; });
    directions_.push_back(std::move(residual));
    left_[0] = length;
  }

  // The residual after one direction more.
  double advance() {
    const auto j = static_cast<Eigen::Index>(directions_.size()) - 1;
    Vector corrected, image;
    preconditioner_.apply(directions_.back(), corrected);
    multiply(matrix_, corrected, image);
    for (Eigen::Index i = 0; i <= j; ++i) {
      upper_(i, j) = dot(directions_[static_cast<std::size_t>(i)], image);
      add(-upper_(i, j), directions_[static_cast<std::size_t>(i)], image);
    }
    const double length = norm(image);
    for (Eigen::Index i = 0; i < j; ++i) {
      const double above = upper_(i, j), below = upper_(i + 1, j);
      upper_(i, j) = cosine_[i] * above + sine_[i] * below;
      upper_(i + 1, j) = cosine_[i] * below - sine_[i] * above;
    }
    const double whole = std::hypot(upper_(j, j), length);
    cosine_[j] = whole > 0 ? upper_(j, j) / whole : 1;
    sine_[j] = whole > 0 ? length / whole : 0;
    upper_(j, j) = whole;
    left_[j + 1] = -sine_[j] * left_[j];
    left_[j] *= cosine_[j];
    if (length > 0) parallel_for_each(image.size(), [&](std::size_t i) { image[i] /= length; });
    directions_.push_back(std::move(image));
    return std::abs(left_[j + 1]);
  }
  [[nodiscard]] bool full() const { return directions_.size() > kDirections; }

  void add_to(Vector& x) const {
    const auto count = static_cast<Eigen::Index>(directions_.size()) - 1;
    Eigen::VectorXd y = left_.head(count);
    upper_.topLeftCorner(count, count).triangularView<Eigen::Upper>().solveInPlace(y);
    Vector sum(x.size(), Vec3::Zero()), corrected;
    for (Eigen::Index i = 0; i < count; ++i) add(y[i], directions_[static_cast<std::size_t>(i)], sum);
    preconditioner_.apply(sum, corrected);
    add(1, corrected, x);
  }

 private:
  const LinearOperator& matrix_;
  const Preconditioner& preconditioner_;
  std::vector<Vector> directions_;
  Eigen::Matrix<double, kDirections + 1, kDirections> upper_ =
      Eigen::Matrix<double, kDirections + 1, kDirections>::Zero();
  Eigen::Matrix<double, kDirections, 1> cosine_, sine_;
  Eigen::VectorXd left_;
};

}  // namespace

LinearResult gmres(const LinearOperator& matrix, const Vector& b, Vector& x,
                   const Preconditioner& preconditioner, double tolerance, int max_iterations,
                   const std::function<void(int, double)>& progress,
                   const std::function<bool(int, double)>& hopeless) {
  LinearResult result;
  x.assign(b.size(), Vec3::Zero());
  const double scale = norm(b);
  if (scale == 0) {
    result.converged = true;
    return result;
  }
  Vector residual = b, image;
  double length = scale;
  bool ended = false;
  while (!ended && result.iterations < max_iterations && std::isfinite(length)) {
    Cycle cycle(matrix, preconditioner, residual, length);
    double estimate = length;
    while (!ended && !cycle.full() && result.iterations < max_iterations && estimate > tolerance * scale) {
      estimate = cycle.advance();
      ++result.iterations;
      if (!std::isfinite(estimate)) return result;
      if (progress) progress(result.iterations, estimate / scale);
      ended = estimate > tolerance * scale && hopeless && hopeless(result.iterations, estimate / scale);
    }
    cycle.add_to(x);
    multiply(matrix, x, image);
    parallel_for_each(b.size(), [&](std::size_t i) { residual[i] = b[i] - image[i]; });
    const double before = length;
    length = norm(residual);
    result.converged = length <= tolerance * scale;
    ended = ended || result.converged || length > (cycle.full() ? kStalled : kAgain) * before;
  }
  result.relative_residual = length / scale;
  result.indefinite = dot(x, image) <= 0;
  return result;
}

}  // namespace flexel::simulate
