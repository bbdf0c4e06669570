// The search directions are kept orthonormal in B, as robust implementations do: the preconditioned residuals by the
// eigenvectors of their scaled Gram matrix, columns that depend on others dropped (Stathopoulos and Wu 2002; Hetmaniuk and
// Lehoucq 2006), the old directions by orthonormal coefficients (Duersch, Shao, Yang and Gu 2018). So Rayleigh and Ritz's
// problem is an ordinary one of three blocks.
#include "simulate/modes/eigenpairs.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/math/dense.h"
#include "base/parallel.h"

namespace flexel::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kRowsAtATime = 4096;
constexpr double kDependent = 1e-12;  // of a scaled Gram matrix's eigenvalues
constexpr int kRenewed = 10;  // iterations after which the images are made anew: they are sums of sums

struct GramSum {
  MatrixXd value;
  GramSum& operator+=(const GramSum& other) {
    if (value.size() == 0)
      value = other.value;
    else if (other.value.size() != 0)
      value += other.value;
    return *this;
  }
};

// a^T b
MatrixXd gram(const MatrixXd& a, const MatrixXd& b) {
  if (a.cols() == 0 || b.cols() == 0) return MatrixXd::Zero(a.cols(), b.cols());
  const auto chunks = static_cast<std::size_t>((a.rows() + kRowsAtATime - 1) / kRowsAtATime);
  return parallel_sum<GramSum>(
             chunks,
             [&](std::size_t chunk) {
               const Index begin = static_cast<Index>(chunk) * kRowsAtATime;
               const Index rows = std::min(kRowsAtATime, a.rows() - begin);
               return GramSum{a.middleRows(begin, rows).transpose() * b.middleRows(begin, rows)};
             },
             1)
      .value;
}

// to += a c
void add_product(const MatrixXd& a, const MatrixXd& c, MatrixXd& to) {
  if (a.cols() == 0 || c.cols() == 0) return;
  parallel_chunks(static_cast<std::size_t>(a.rows()), kRowsAtATime, [&](std::size_t begin, std::size_t end) {
    const auto first = static_cast<Index>(begin), rows = static_cast<Index>(end - begin);
    to.middleRows(first, rows).noalias() += a.middleRows(first, rows) * c;
  });
}

MatrixXd product(const MatrixXd& a, const MatrixXd& c) {
  MatrixXd made = MatrixXd::Zero(a.rows(), c.cols());
  add_product(a, c, made);
  return made;
}

MatrixXd images(const LinearMap& map, const MatrixXd& x) {
  MatrixXd y(x.rows(), x.cols());
  for (Index j = 0; j < x.cols(); ++j) map(x.col(j).data(), y.col(j).data());
  return y;
}

// C with (X C)^T B (X C) = I, of X^T B X; with fewer columns where some depend on others.
MatrixXd orthonormalising(const MatrixXd& squares) {
  const Index n = squares.rows();
  if (n == 0) return MatrixXd::Zero(0, 0);
  VectorXd scale(n);
  for (Index i = 0; i < n; ++i) scale[i] = squares(i, i) > 0 ? 1 / std::sqrt(squares(i, i)) : 0;
  const MatrixXd scaled = scale.asDiagonal() * squares * scale.asDiagonal();
  const SymmetricEigen eigen = eigen_symmetric(0.5 * (scaled + scaled.transpose()));
  Index first = 0;
  while (first < n && !(eigen.values[first] > kDependent * eigen.values[n - 1])) ++first;
  if (!(eigen.values[n - 1] > 0)) return MatrixXd::Zero(n, 0);
  MatrixXd made = scale.asDiagonal() * eigen.vectors.rightCols(n - first);
  for (Index j = 0; j < made.cols(); ++j) made.col(j) /= std::sqrt(eigen.values[first + j]);
  return made;
}

// Columns with their images.
struct Columns {
  MatrixXd x, a, b;
  [[nodiscard]] Columns times(const MatrixXd& c) const {
    return {product(x, c), product(a, c), product(b, c)};
  }
  void add(const Columns& other, const MatrixXd& c) {
    add_product(other.x, c, x);
    add_product(other.a, c, a);
    add_product(other.b, c, b);
  }
};

class Iteration {
 public:
  Iteration(const Pencil& pencil, MatrixXd start, const EigenOptions& options)
      : pencil_(pencil), options_(options) {
    now_.x = std::move(start);
    begin();
  }

  Eigenpairs run(const std::function<void(int, Index)>& progress) {
    Eigenpairs found;
    for (;; ++found.iterations) {
      find_residuals();
      const Index done = std::count_if(errors_.data(), errors_.data() + wanted(),
                                       [&](double error) { return error <= options_.tolerance; });
      if (progress) progress(found.iterations, done);
      found.converged = done == wanted();
      if (found.converged || found.iterations == options_.most_iterations || directions_.cols() == 0) break;
      advance();
      if (found.iterations % kRenewed == kRenewed - 1) begin();
    }
    found.values = values_.head(wanted());
    found.vectors = now_.x.leftCols(wanted());
    found.errors = errors_.head(wanted());
    return found;
  }

 private:
  [[nodiscard]] Index wanted() const { return std::min(options_.wanted, now_.x.cols()); }

  // Orthonormal columns of which each is an approximate eigenvector, images anew.
  void begin() {
    for (int time = 0; time < 2; ++time) {
      now_.b = images(pencil_.b, now_.x);
      now_.x = product(now_.x, orthonormalising(gram(now_.x, now_.b)));
    }
    now_.b = images(pencil_.b, now_.x);
    now_.a = images(pencil_.a, now_.x);
    const MatrixXd energy = gram(now_.x, now_.a);
    const SymmetricEigen ritz = eigen_symmetric(0.5 * (energy + energy.transpose()));
    values_ = ritz.values;
    now_ = now_.times(ritz.vectors);
    if (old_.x.cols() > 0) {
      old_.a = images(pencil_.a, old_.x);
      old_.b = images(pencil_.b, old_.x);
    }
  }

  // Errors, and the preconditioned residuals of the columns that have not converged.
  void find_residuals() {
    const Index n = now_.x.cols();
    errors_.resize(n);
    MatrixXd left = now_.a - now_.b * values_.asDiagonal();
    directions_.resize(now_.x.rows(), n);
    active_.clear();
    for (Index j = 0; j < n; ++j) {
      const auto to = static_cast<Index>(active_.size());
      pencil_.precondition(left.col(j).data(), directions_.col(to).data());
      const double value = std::max(std::abs(values_[j]), pencil_.rounding);
      const double off = std::max(0.0, left.col(j).dot(directions_.col(to)));
      errors_[j] = std::sqrt(off) / (pencil_.inverts_b ? value : std::sqrt(value));
      if (!(errors_[j] <= options_.tolerance)) active_.push_back(j);
    }
    directions_.conservativeResize(Eigen::NoChange, static_cast<Index>(active_.size()));
  }

  void project(Columns& w, bool a) const {
    for (const Columns* base : {&now_, &old_}) {
      if (base->x.cols() == 0) continue;
      const MatrixXd share = -gram(base->b, w.x);
      add_product(base->x, share, w.x);
      if (w.b.size() != 0) add_product(base->b, share, w.b);
      if (a) add_product(base->a, share, w.a);
    }
  }

  [[nodiscard]] Columns new_directions() {
    Columns w{std::move(directions_), {}, {}};
    project(w, false);
    w.b = images(pencil_.b, w.x);
    for (int time = 0; time < 2; ++time) {
      const MatrixXd c = orthonormalising(gram(w.x, w.b));
      w.x = product(w.x, c);
      w.b = product(w.b, c);
      project(w, false);
    }
    const MatrixXd c = orthonormalising(gram(w.x, w.b));
    w.x = product(w.x, c);
    w.b = product(w.b, c);
    w.a = images(pencil_.a, w.x);
    return w;
  }

  // Rayleigh and Ritz in the span of the columns, the new directions and the old ones.
  void advance() {
    const Columns w = new_directions();
    const Index n = now_.x.cols(), m = w.x.cols(), p = old_.x.cols();
    MatrixXd energy = MatrixXd::Zero(n + m + p, n + m + p);
    energy.topLeftCorner(n, n) = values_.asDiagonal();
    energy.block(0, n, n, m) = gram(now_.x, w.a);
    energy.block(0, n + m, n, p) = gram(now_.x, old_.a);
    energy.block(n, n, m, m) = gram(w.x, w.a);
    energy.block(n, n + m, m, p) = gram(w.x, old_.a);
    energy.block(n + m, n + m, p, p) = gram(old_.x, old_.a);
    const MatrixXd whole = energy.selfadjointView<Eigen::Upper>();
    const SymmetricEigen ritz = eigen_symmetric(whole);
    values_ = ritz.values.head(n);
    const MatrixXd best = ritz.vectors.leftCols(n);
    const MatrixXd along = old_coefficients(best, n);
    Columns next = now_.times(best.topRows(n)), old = now_.times(along.topRows(n));
    next.add(w, best.middleRows(n, m));
    old.add(w, along.middleRows(n, m));
    next.add(old_, best.bottomRows(p));
    old.add(old_, along.bottomRows(p));
    now_ = std::move(next);
    old_ = std::move(old);
  }

  // Of what the columns that have not converged changed by, made orthonormal to `best`.
  [[nodiscard]] MatrixXd old_coefficients(const MatrixXd& best, Index n) const {
    MatrixXd made(best.rows(), static_cast<Index>(active_.size()));
    for (std::size_t j = 0; j < active_.size(); ++j) made.col(static_cast<Index>(j)) = best.col(active_[j]);
    made.topRows(n).setZero();
    for (int time = 0; time < 2; ++time) {
      made -= best * (best.transpose() * made);
      made = (made * orthonormalising(made.transpose() * made)).eval();
    }
    return made;
  }

  const Pencil& pencil_;
  const EigenOptions& options_;
  Columns now_, old_;
  VectorXd values_, errors_;
  MatrixXd directions_;
  std::vector<Index> active_;
};

}  // namespace

Eigenpairs lowest_eigenpairs(const Pencil& pencil, MatrixXd start, const EigenOptions& options,
                             const std::function<void(int, Index)>& progress) {
  return Iteration(pencil, std::move(start), options).run(progress);
}

}  // namespace flexel::simulate
