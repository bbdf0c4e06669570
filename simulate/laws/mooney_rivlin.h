// Mooney (1940) and Rivlin (1948), compressible, for rubber; CalculiX's *HYPERELASTIC, MOONEY-RIVLIN with D1 = 2/K:
//     W = C10 (I1' - 3) + C01 (I2' - 3) + K/2 (J - 1)^2,   I1' = J^-2/3 I1,   I2' = J^-4/3 I2
// At small strain mu = 2 (C10 + C01), bulk modulus K. With e = b - I, b = F F^T, a = J^-2/3 the Kirchhoff stress is
//     tau = 2 C10 a dev e + 2 C01 a^2 dev((1 + tr e) e - e e) + K (J - 1) J I,   P = tau F^-T.
// Small strains keep their digits: no term of tau cancels, and with s = J^2 - 1 = tr e + i2 + i3 (the invariants
// of e) the energies are sums of second order,
//     I1' - 3 = [3 (1 + s)^-1/3 - 3 + s] - i2 - i3 + (a - 1) tr e
//     I2' - 3 = [3 (1 + s)^-2/3 - 3 + 2 s] - i2 - 2 i3 + (a^2 - 1) (2 tr e + i2),
// whose brackets are a series where s is small.
#pragma once
#include "simulate/laws/law.h"
#include "simulate/laws/tensor.h"

namespace flexel::simulate::laws {
namespace {

struct MooneyRivlin {
  // J/m^3. Needs J > 0.
  template <class T>
  FLEXEL_INLINE static T energy(const Law& law, const Matrix<T>& h) {
    const Kinematics<T> g = kinematics(h);
    const Matrix<T> e = strain(h), minors = laws::cofactor(e);
    const T first = trace(e), second = trace(minors);
    const T third =
        e.at[0][0] * minors.at[0][0] + e.at[0][1] * minors.at[0][1] + e.at[0][2] * minors.at[0][2];
    const T s = g.change * (2 + g.change);
    const T a = inverse_cube_root(g.jacobian * g.jacobian);
    const T one = power_remainder(s, -1.0 / 3, a), two = power_remainder(s, -2.0 / 3, a * a);
    const T i1 = 3 * one - second - third + (one - s * (1.0 / 3)) * first;
    const T i2 = 3 * two - second - 2 * third + (two - s * (2.0 / 3)) * (2 * first + second);
    return law.c10 * i1 + law.c01 * i2 + 0.5 * law.bulk * g.change * g.change;
  }

  // P [Pa]. Needs J > 0.
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress(const Law& law, const Kinematics<T>& g) {
    const T a = inverse_cube_root(g.jacobian * g.jacobian);
    const Matrix<T> tau = kirchhoff(law, strain(g.h), a, law.bulk * g.change * g.jacobian);
    return by_inverse_transpose(tau, g);
  }

  // dP of F that changes by `d` [Pa].
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress_change(const Law& law, const Matrix<T>& h, const Matrix<T>& d) {
    const Kinematics<T> g = kinematics(h);
    const Matrix<T> e = strain(h), squared = product(e, e);
    const T a = inverse_cube_root(g.jacobian * g.jacobian);
    const Matrix<T> tau = kirchhoff(law, e, a, law.bulk * g.change * g.jacobian);
    Matrix<T> l;  // dF F^-1
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        l.at[i][j] = g.inverse * (d.at[i][0] * g.cofactor.at[j][0] + d.at[i][1] * g.cofactor.at[j][1] +
                                  d.at[i][2] * g.cofactor.at[j][2]);
    const T swelling = trace(l);
    Matrix<T> de = product(l, e);  // l b + b l^T, b = I + e
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) de.at[i][j] += l.at[i][j];
    de = twice_symmetric(de);
    const T more = 1 + trace(e), change = trace(de);
    const Matrix<T> both = twice_symmetric(product(de, e));
    Matrix<T> first, second;  // d(a e), d(a^2 ((1 + tr e) e - e e))
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        first.at[i][j] = a * (de.at[i][j] - (2.0 / 3) * swelling * e.at[i][j]);
        const T inside = more * e.at[i][j] - squared.at[i][j];
        second.at[i][j] =
            a * a *
            (change * e.at[i][j] + more * de.at[i][j] - both.at[i][j] - (4.0 / 3) * swelling * inside);
      }
    first = deviator(first);
    second = deviator(second);
    const T pressure = law.bulk * (2 * g.jacobian - 1) * g.jacobian * swelling;
    const Matrix<T> carried = product_transposed(tau, l);
    Matrix<T> sum;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        sum.at[i][j] = 2 * law.c10 * first.at[i][j] + 2 * law.c01 * second.at[i][j] +
                       (i == j ? pressure : T{}) - carried.at[i][j];
    return by_inverse_transpose(sum, g);
  }

 private:
  // b - I
  template <class T>
  FLEXEL_INLINE static Matrix<T> strain(const Matrix<T>& h) {
    Matrix<T> e = product_transposed(h, h);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) e.at[i][j] += h.at[i][j] + h.at[j][i];
    return e;
  }

  template <class T>
  FLEXEL_INLINE static Matrix<T> twice_symmetric(const Matrix<T>& m) {
    Matrix<T> s;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) s.at[i][j] = m.at[i][j] + m.at[j][i];
    return s;
  }

  template <class T>
  FLEXEL_INLINE static Matrix<T> kirchhoff(const Law& law, const Matrix<T>& e, const T& a,
                                           const T& pressure) {
    const T one = 2 * law.c10 * a, two = 2 * law.c01 * a * a, more = 1 + trace(e);
    const Matrix<T> squared = product(e, e);
    Matrix<T> tau;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        tau.at[i][j] = one * e.at[i][j] + two * (more * e.at[i][j] - squared.at[i][j]);
    tau = deviator(tau);
    for (int i = 0; i < 3; ++i) tau.at[i][i] += pressure;
    return tau;
  }

  // m F^-T
  template <class T>
  FLEXEL_INLINE static Matrix<T> by_inverse_transpose(const Matrix<T>& m, const Kinematics<T>& g) {
    Matrix<T> p = product(m, g.cofactor);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p.at[i][j] *= g.inverse;
    return p;
  }

  // (1 + s)^n - 1 - n s, without cancellation; `power` is (1 + s)^n.
  template <class T>
  FLEXEL_INLINE static T power_remainder(const T& s, double n, const T& power) {
    double factor[9] = {1};
    for (int k = 1; k < 9; ++k) factor[k] = factor[k - 1] * (n - (k - 1)) / k;
    T sum = factor[8] + T{};
    for (int k = 7; k > 1; --k) sum = factor[k] + s * sum;
    const auto small = (s < 1e-2) & (s > -1e-2);
    return small ? s * s * sum : power - 1 - n * s;
  }
};

}  // namespace
}  // namespace flexel::simulate::laws
