// Small tensors over a number type, double or eight cells side by side (simd::Lanes). What the laws are written
// in. Included by kernels: nothing of the standard library or of Eigen, and all of it internal to a file.
#pragma once
#include "base/simd.h"

namespace flexel::simulate::laws {
namespace {

template <class T>
struct Matrix {
  T at[3][3];
};

template <class T>
FLEXEL_INLINE Matrix<T> cofactor(const Matrix<T>& m) {
  Matrix<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      c.at[i][j] = m.at[i1][j1] * m.at[i2][j2] - m.at[i1][j2] * m.at[i2][j1];
    }
  return c;
}

// What the laws need of F = I + H.
template <class T>
struct Kinematics {
  Matrix<T> h, cofactor, less_one;  // H; cof F; cof F - I without cancellation
  T jacobian, inverse;              // J, 1 / J
  T trace, change;                  // tr H; J - 1
};

// Calls `checked` with J - 1 and goes on with what it gives back.
template <class T, class Checked>
FLEXEL_INLINE Kinematics<T> kinematics(const Matrix<T>& h, const Checked& checked) {
  Kinematics<T> g;
  g.h = h;
  const Matrix<T> second = laws::cofactor(h);
  g.trace = h.at[0][0] + h.at[1][1] + h.at[2][2];
  const T sum_of_minors = second.at[0][0] + second.at[1][1] + second.at[2][2];
  const T determinant =
      h.at[0][0] * second.at[0][0] + h.at[0][1] * second.at[0][1] + h.at[0][2] * second.at[0][2];
  g.change = checked(g.trace + sum_of_minors + determinant);
  g.jacobian = 1 + g.change;
  g.inverse = 1 / g.jacobian;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      g.less_one.at[i][j] = second.at[i][j] - h.at[j][i];
      if (i == j) g.less_one.at[i][j] += g.trace;
      g.cofactor.at[i][j] = g.less_one.at[i][j];
      if (i == j) g.cofactor.at[i][j] += 1.0;
    }
  return g;
}

template <class T>
FLEXEL_INLINE Kinematics<T> kinematics(const Matrix<T>& h) {
  return kinematics(
      h, [](const T& change) __attribute__((always_inline))->T { return change; });
}

// a b, a b^T
template <class T>
FLEXEL_INLINE Matrix<T> product(const Matrix<T>& a, const Matrix<T>& b) {
  Matrix<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c.at[i][j] = a.at[i][0] * b.at[0][j] + a.at[i][1] * b.at[1][j] + a.at[i][2] * b.at[2][j];
  return c;
}
template <class T>
FLEXEL_INLINE Matrix<T> product_transposed(const Matrix<T>& a, const Matrix<T>& b) {
  Matrix<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c.at[i][j] = a.at[i][0] * b.at[j][0] + a.at[i][1] * b.at[j][1] + a.at[i][2] * b.at[j][2];
  return c;
}

// a^T b
template <class T>
FLEXEL_INLINE Matrix<T> transposed_product(const Matrix<T>& a, const Matrix<T>& b) {
  Matrix<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c.at[i][j] = a.at[0][i] * b.at[0][j] + a.at[1][i] * b.at[1][j] + a.at[2][i] * b.at[2][j];
  return c;
}

template <class T>
FLEXEL_INLINE T trace(const Matrix<T>& m) {
  return m.at[0][0] + m.at[1][1] + m.at[2][2];
}

template <class T>
FLEXEL_INLINE Matrix<T> deviator(Matrix<T> m) {
  const T third = trace(m) * (1.0 / 3);
  for (int i = 0; i < 3; ++i) m.at[i][i] -= third;
  return m;
}

template <class T>
struct Words {
  using type = simd::LaneWords;
};
template <>
struct Words<double> {
  using type = unsigned long long;
};

// x^(-1/3) for x > 0 (any number for others), to a few units in the last place, the same bits for both number
// types: a first guess from the exponent (3.5 % off), four steps of Newton's method for y^-3 = x.
template <class T>
FLEXEL_INLINE T inverse_cube_root(const T& x) {
  using Word = typename Words<T>::type;
  Word bits;
  __builtin_memcpy(&bits, &x, sizeof bits);
  bits = 0x553ef0ff289dd796ULL - bits / 3ULL;
  T y;
  __builtin_memcpy(&y, &bits, sizeof y);
  for (int step = 0; step < 4; ++step) y = y * (4 - x * (y * y * y)) * (1.0 / 3);
  return y;
}

}  // namespace
}  // namespace flexel::simulate::laws
