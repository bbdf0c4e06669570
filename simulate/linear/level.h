// One level of the hierarchy: its matrix, its smoother and the way to the next coarser level.
#pragma once
#include <cmath>
#include <type_traits>
#include <vector>

#include "base/math/eigenvalues.h"
#include "simulate/linear/block_inverse.h"
#include "simulate/linear/transfer.h"

namespace flexel::simulate {

// Chebyshev polynomial of degree two in D^-1 A over [largest / 8, largest] (Adams, Brezina, Hu, Tuminaro
// 2003):
//   first = x + inverse_centre D^-1 (b - A x);  result = first + momentum (first - x) + gain D^-1 (b - A
//   first)
struct Chebyshev {
  double inverse_centre = 0, momentum = 0, gain = 0;
};

[[nodiscard]] inline Chebyshev chebyshev(double largest) {
  constexpr double kRange = 8;
  const double centre = .5 * (largest + largest / kRange), half_width = .5 * (largest - largest / kRange);
  const double sigma = centre / half_width;
  const double first = 1 / sigma, second = 1 / (2 * sigma - first);
  return {1 / centre, second * first, 2 * second / half_width};
}

template <int R>
struct Level {
  using Inverse = Eigen::Matrix<float, R, R>;
  using Vector = Eigen::Matrix<double, R, 1>;
  std::vector<Inverse> inverse_diagonal;              // (rows)
  std::vector<Eigen::Matrix<double, R, R>> inverted;  // (rows) the blocks that these are of; empty: not kept
  double largest_eigenvalue = 0;                      // of D^-1 A, estimated from below
  std::vector<float> eigenvector;  // (rows x R) that the estimate is from; of elements only
  Chebyshev smoother;
  Transfer<R> transfer;
  mutable std::vector<double> rhs, x, next;  // (rows x R) work of one cycle
  // (rows x R) likewise, of an operator: A times a vector, and D^-1 times a residual
  mutable std::vector<double> image, scaled;
};

// Weight of the step that smooths the prolongator; the estimate is from below, hence 1.05.
[[nodiscard]] inline double smoothing_weight(double largest_eigenvalue) {
  return 4. / 3 / (1.05 * largest_eigenvalue);
}

// Directions in which a support holds element i directly: moving i and its neighbours together along such a
// direction is resisted nearly as much as moving i alone (elastic links do not resist that at all). Returns
// the projector on the other directions. A coarse motion must leave held elements alone: one that drags them
// against a penalty of hundreds of E / h would cost so much that the free elements of the same aggregate
// would get no coarse motion either.
// `sum`: of the blocks of its row, `own`: the diagonal one.
[[nodiscard]] inline Mat3 free_directions(const Mat3& sum, const Mat3& own) {
  constexpr double kHeldShare = .5;
  if (sum.norm() < .1 * own.norm()) return Mat3::Identity();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(Mat3(.5 * (sum + sum.transpose())));
  Mat3 projector = Mat3::Identity();
  for (int c = 0; c < 3; ++c) {
    const Vec3 direction = eigen.eigenvectors().col(c);
    if (eigen.eigenvalues()[c] > kHeldShare * direction.dot(own * direction))
      projector -= direction * direction.transpose();
  }
  return projector;
}

constexpr std::size_t kRowGrain = 256;
constexpr std::size_t kKeptBlocks = 65'536;  // rows, up to which a level keeps what it has inverted

// body(i, (A x)_i) for every row; `image` (rows x R) may be overwritten.
template <int R, class Body>
void for_each_product(const LinearOperator& matrix, const double* x, double* image, const Body& body) {
  matrix.multiply(x, image);
  parallel_for_each(matrix.rows(), [&](std::size_t i) {
    body(i, Eigen::Map<const Eigen::Matrix<double, R, 1>>(image + i * R));
  });
}

// Blocks are read past their end: `values` has one more than there are.
template <int R, class BlockType, class Body>
void for_each_product(const MatrixView<BlockType>& matrix, const double* x, double*, const Body& body) {
  static_assert(R == 6);
  constexpr bool kFloat = std::is_same_v<typename BlockType::Scalar, float>;
  const auto row = [] {
    if constexpr (kFloat)
      return galerkin_table().row;
    else
      return galerkin_table().row_of_doubles;
  }();
  parallel_for_each(
      matrix.rows(),
      [&](std::size_t i) {
        double sum[R];
        const std::uint64_t first = matrix.offsets[i];
        row(matrix.values[first].data(), matrix.columns.data() + first, matrix.offsets[i + 1] - first, x,
            sum);
        body(i, Eigen::Map<const Eigen::Matrix<double, R, 1>>(sum));
      },
      kRowGrain);
}

template <int R>
[[nodiscard]] Eigen::Map<const Eigen::Matrix<double, R, 1>> entry(const double* x, std::size_t i) {
  return Eigen::Map<const Eigen::Matrix<double, R, 1>>(x + i * R);
}
template <int R>
[[nodiscard]] Eigen::Map<Eigen::Matrix<double, R, 1>> entry(double* x, std::size_t i) {
  return Eigen::Map<Eigen::Matrix<double, R, 1>>(x + i * R);
}

template <int R>
[[nodiscard]] Eigen::Matrix<double, R, 1> times(const Eigen::Matrix<float, R, R>& block,
                                                const Eigen::Matrix<double, R, 1>& x) {
  return block.template cast<double>() * x;
}

// A fixed pseudo-random number in [-1, 1) (splitmix64 of Steele, Lea and Flood 2014).
[[nodiscard]] inline double scattered(std::uint64_t i) {
  std::uint64_t z = (i + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1;
}

// Where the estimate of the largest eigenvalue begins: anywhere, or at the eigenvector of a matrix that was
// nearly the same, in a third of the steps.
enum class Estimate { anew, onwards };

// Inverts the diagonal blocks and estimates the largest eigenvalue of D^-1 A by power iteration.
// `multiply(x, y)`: y = A x. The level's work vectors are overwritten.
template <int R, class BlockType, class Multiply>
void prepare_smoother(const std::vector<BlockType>& diagonal, const Multiply& multiply, Level<R>& level,
                      Estimate estimate = Estimate::anew) {
  const std::size_t n = diagonal.size();
  double largest = 0;
  for (const BlockType& block : diagonal) largest = std::max(largest, block.diagonal().cwiseAbs().maxCoeff());
  level.inverse_diagonal.resize(n);
  const bool onwards = estimate == Estimate::onwards && level.eigenvector.size() == n * R;
  const bool keeps = onwards && n <= kKeptBlocks, kept = keeps && level.inverted.size() == n;
  level.inverted.resize(keeps ? n : 0);
  parallel_for_each(n, [&](std::size_t i) {
    const Eigen::Matrix<double, R, R> block = diagonal[i];
    if (kept && block == level.inverted[i]) return;
    level.inverse_diagonal[i] = guarded_inverse<R>(block, 1e-14 * largest).template cast<float>();
    if (keeps) level.inverted[i] = block;
  });
  const int steps = onwards ? 4 : 12;
  double* v = level.next.data();
  double* w = (R == 3 ? level.image : level.x).data();
  // Some of anything stays in it, should the stiffest motion have become another.
  parallel_for_each(n * R, [&](std::size_t k) {
    v[k] = onwards ? std::sqrt(double(n * R)) * level.eigenvector[k] + .1 * scattered(k) : scattered(k);
  });
  level.largest_eigenvalue = 1;
  for (int step = 0; step < steps; ++step) {
    multiply(v, w);
    parallel_for_each(n, [&](std::size_t i) {
      entry<R>(w, i) = times<R>(level.inverse_diagonal[i], entry<R>(static_cast<const double*>(w), i));
    });
    const double before = parallel_sum<double>(n * R, [&](std::size_t k) { return v[k] * v[k]; });
    const double after = parallel_sum<double>(n * R, [&](std::size_t k) { return w[k] * w[k]; });
    if (!(after > 0) || !std::isfinite(after)) break;
    level.largest_eigenvalue = std::sqrt(after / before);
    parallel_for_each(n * R, [&](std::size_t k) { v[k] = w[k] / std::sqrt(after); });
  }
  if constexpr (R == 3) {
    level.eigenvector.resize(n * R);
    parallel_for_each(n * R, [&](std::size_t k) { level.eigenvector[k] = static_cast<float>(v[k]); });
  }
  level.smoother = chebyshev(1.1 * level.largest_eigenvalue);
}

// x = smoothed solution of A x = b from x = 0; `work` is overwritten. All (rows x R).
template <int R, class View>
void smooth_from_zero(const View& matrix, const Level<R>& level, const double* b, double* x, double* work) {
  const Chebyshev& c = level.smoother;
  parallel_for_each(matrix.rows(), [&](std::size_t i) {
    entry<R>(work, i) = c.inverse_centre * times<R>(level.inverse_diagonal[i], entry<R>(b, i));
  });
  for_each_product<R>(matrix, work, level.image.data(), [&](std::size_t i, const auto& product) {
    const Eigen::Matrix<double, R, 1> residual = entry<R>(b, i) - product;
    entry<R>(x, i) =
        (1 + c.momentum) * entry<R>(work, i) + c.gain * times<R>(level.inverse_diagonal[i], residual);
  });
}

// Improves x; `work` is overwritten.
template <int R, class View>
void smooth(const View& matrix, const Level<R>& level, const double* b, double* x, double* work) {
  const Chebyshev& c = level.smoother;
  for_each_product<R>(matrix, x, level.image.data(), [&](std::size_t i, const auto& product) {
    const Eigen::Matrix<double, R, 1> residual = entry<R>(b, i) - product;
    entry<R>(work, i) = entry<R>(x, i) + c.inverse_centre * times<R>(level.inverse_diagonal[i], residual);
  });
  for_each_product<R>(matrix, work, level.image.data(), [&](std::size_t i, const auto& product) {
    const Eigen::Matrix<double, R, 1> residual = entry<R>(b, i) - product;
    const Eigen::Matrix<double, R, 1> first = entry<R>(work, i);
    entry<R>(x, i) = first + c.momentum * (first - entry<R>(x, i)) +
                     c.gain * times<R>(level.inverse_diagonal[i], residual);
  });
}

// coarse = P^T (b - A x); `work` is overwritten with the residual.
template <class View>
void restrict_residual(const View& matrix, const Level<6>& level, const double* b, const double* x,
                       double* work, double* coarse) {
  for_each_product<6>(matrix, x, level.image.data(), [&](std::size_t i, const auto& product) {
    entry<6>(work, i) = entry<6>(b, i) - product;
  });
  const Transfer<6>& t = level.transfer;
  const auto one_row = galerkin_table().restriction;
  parallel_for_each(
      t.coarse_rows,
      [&](std::size_t a) {
        const std::uint64_t first = t.transposed_offsets[a];
        one_row(t.values.front().data(), t.transposed_positions.data() + first,
                t.transposed_rows.data() + first, t.transposed_offsets[a + 1] - first, work, coarse + 6 * a);
      },
      32);
}

// x += P coarse
inline void prolong(const Level<6>& level, const double* coarse, double* x) {
  const Transfer<6>& t = level.transfer;
  const auto one_row = galerkin_table().prolongation;
  parallel_for_each(t.pattern.offsets.size() - 1, [&](std::size_t i) {
    const std::uint64_t first = t.pattern.offsets[i];
    one_row(t.values.front().data() + 36 * first, t.pattern.columns.data() + first,
            t.pattern.offsets[i + 1] - first, coarse, x + 6 * i);
  });
}

}  // namespace flexel::simulate
