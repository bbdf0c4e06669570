// One level of the hierarchy: its matrix, its smoother and the way to the next coarser level.
#pragma once
#include <cmath>
#include <vector>

#include "simulate/linear/block_inverse.h"
#include "simulate/linear/transfer.h"

namespace flexel {

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
  std::vector<Inverse> inverse_diagonal;  // (rows)
  double largest_eigenvalue = 0;          // of D^-1 A, estimated from below
  Chebyshev smoother;
  Transfer<R> transfer;
  mutable std::vector<double> rhs, x, next;  // (rows x R) work of one cycle
  // (rows x R) likewise, of an operator: A times a vector, and D^-1 times a residual
  mutable std::vector<double> image, scaled;
};

constexpr std::size_t kRowGrain = 256;

// body(i, (A x)_i) for every row; `image` (rows x R) may be overwritten.
template <int R, class Body>
void for_each_product(const LinearOperator& matrix, const double* x, double* image, const Body& body) {
  matrix.multiply(x, image);
  parallel_for_each(matrix.rows(), [&](std::size_t i) {
    body(i, Eigen::Map<const Eigen::Matrix<double, R, 1>>(image + i * R));
  });
}

template <int R, class View, class Body>
void for_each_product(const View& matrix, const double* x, double*, const Body& body) {
  parallel_for_each(
      matrix.rows(),
      [&](std::size_t i) {
        double sum[R] = {};
        for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q) {
          const auto* values = matrix.values[q].data();
          const double* from = x + static_cast<std::size_t>(matrix.columns[q]) * R;
          if constexpr (R == 3) {  // row major
            for (int r = 0; r < R; ++r) {
              sum[r] += double(values[3 * r]) * from[0] + double(values[3 * r + 1]) * from[1] +
                        double(values[3 * r + 2]) * from[2];
            }
          } else {
            for (int c = 0; c < R; ++c) {
              for (int r = 0; r < R; ++r) sum[r] += double(values[R * c + r]) * from[c];
            }
          }
        }
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

// Inverts the diagonal blocks and estimates the largest eigenvalue of D^-1 A by power iteration.
// `multiply(x, y)`: y = A x.
template <int R, class BlockType, class Multiply>
void prepare_smoother(const std::vector<BlockType>& diagonal, const Multiply& multiply, Level<R>& level) {
  const std::size_t n = diagonal.size();
  double largest = 0;
  for (const BlockType& block : diagonal) largest = std::max(largest, block.diagonal().cwiseAbs().maxCoeff());
  level.inverse_diagonal.resize(n);
  parallel_for_each(n, [&](std::size_t i) {
    const Eigen::Matrix<double, R, R> block = diagonal[i];
    level.inverse_diagonal[i] = guarded_inverse<R>(block, 1e-14 * largest).template cast<float>();
  });
  constexpr int kSteps = 12;
  std::vector<double> v(n * R), w(n * R);
  parallel_for_each(n * R, [&](std::size_t k) { v[k] = scattered(k); });
  level.largest_eigenvalue = 1;
  for (int step = 0; step < kSteps; ++step) {
    multiply(v.data(), w.data());
    parallel_for_each(n, [&](std::size_t i) {
      entry<R>(w.data(), i) = times<R>(level.inverse_diagonal[i], entry<R>(w.data(), i));
    });
    const double before = parallel_sum<double>(n * R, [&](std::size_t k) { return v[k] * v[k]; });
    const double after = parallel_sum<double>(n * R, [&](std::size_t k) { return w[k] * w[k]; });
    if (!(after > 0) || !std::isfinite(after)) break;
    level.largest_eigenvalue = std::sqrt(after / before);
    parallel_for_each(n * R, [&](std::size_t k) { v[k] = w[k] / std::sqrt(after); });
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

}  // namespace flexel
