// What laws of J^-1/3 F share: b - I, I1' - 3 without cancellation, and the way from Kirchhoff's stress to P. With
// e = b - I, b = F F^T, a = J^-2/3, and s = J^2 - 1 = tr e + i2 + i3 (the invariants of e)
//     I1' - 3 = a I1 - 3 = [3 (1 + s)^-1/3 - 3 + s] - i2 - i3 + (a - 1) tr e,
// whose bracket is a series where s is small.
#pragma once
#include "simulate/laws/tensor.h"

namespace flexel::simulate::laws {
namespace {

// b - I
template <class T>
FLEXEL_INLINE Matrix<T> left_strain(const Matrix<T>& h) {
  Matrix<T> e = product_transposed(h, h);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) e.at[i][j] += h.at[i][j] + h.at[j][i];
  return e;
}

template <class T>
FLEXEL_INLINE Matrix<T> twice_symmetric(const Matrix<T>& m) {
  Matrix<T> s;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) s.at[i][j] = m.at[i][j] + m.at[j][i];
  return s;
}

// m F^-T
template <class T>
FLEXEL_INLINE Matrix<T> by_inverse_transpose(const Matrix<T>& m, const Kinematics<T>& g) {
  Matrix<T> p = product(m, g.cofactor);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) p.at[i][j] *= g.inverse;
  return p;
}

// dF F^-1 of F that changes by `d`.
template <class T>
FLEXEL_INLINE Matrix<T> velocity_gradient(const Kinematics<T>& g, const Matrix<T>& d) {
  Matrix<T> l;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      l.at[i][j] = g.inverse * (d.at[i][0] * g.cofactor.at[j][0] + d.at[i][1] * g.cofactor.at[j][1] +
                                d.at[i][2] * g.cofactor.at[j][2]);
  return l;
}

// (1 + s)^n - 1 - n s, without cancellation; `power` is (1 + s)^n.
template <class T>
FLEXEL_INLINE T power_remainder(const T& s, double n, const T& power) {
  double factor[9] = {1};
  for (int k = 1; k < 9; ++k) factor[k] = factor[k - 1] * (n - (k - 1)) / k;
  T sum = factor[8] + T{};
  for (int k = 7; k > 1; --k) sum = factor[k] + s * sum;
  const auto small = (s < 1e-2) & (s > -1e-2);
  return small ? s * s * sum : power - 1 - n * s;
}

// e's invariants, s and a, as above.
template <class T>
struct Isochoric {
  T first, second, third, s, a;
};

template <class T>
FLEXEL_INLINE Isochoric<T> isochoric(const Kinematics<T>& g, const Matrix<T>& e) {
  const Matrix<T> minors = laws::cofactor(e);
  return {trace(e), trace(minors),
          e.at[0][0] * minors.at[0][0] + e.at[0][1] * minors.at[0][1] + e.at[0][2] * minors.at[0][2],
          g.change * (2 + g.change), inverse_cube_root(g.jacobian * g.jacobian)};
}

// I1' - 3
template <class T>
FLEXEL_INLINE T first_excess(const Isochoric<T>& of) {
  const T one = power_remainder(of.s, -1.0 / 3, of.a);
  return 3 * one - of.second - of.third + (one - of.s * (1.0 / 3)) * of.first;
}

}  // namespace
}  // namespace flexel::simulate::laws
