// Mooney (1940) and Rivlin (1948), compressible, for rubber; CalculiX's *HYPERELASTIC, MOONEY-RIVLIN with D1 = 2/K:
//     W = C10 (I1' - 3) + C01 (I2' - 3) + K/2 (J - 1)^2,   I1' = J^-2/3 I1,   I2' = J^-4/3 I2
// At small strain mu = 2 (C10 + C01), bulk modulus K. With e = b - I, b = F F^T, a = J^-2/3 the Kirchhoff stress is
//     tau = 2 C10 a dev e + 2 C01 a^2 dev((1 + tr e) e - e e) + K (J - 1) J I,   P = tau F^-T.
// Small strains keep their digits: no term of tau cancels, and as I1' - 3 (isochoric.h) is
//     I2' - 3 = [3 (1 + s)^-2/3 - 3 + 2 s] - i2 - 2 i3 + (a^2 - 1) (2 tr e + i2)
// a sum of second order.
#pragma once
#include "simulate/laws/isochoric.h"
#include "simulate/laws/law.h"

namespace flexel::simulate::laws {
namespace {

struct MooneyRivlin {
  // J/m^3. Needs J > 0.
  template <class T>
  FLEXEL_INLINE static T energy(const Law& law, const Matrix<T>& h) {
    const Kinematics<T> g = kinematics(h);
    const Isochoric<T> of = isochoric(g, left_strain(h));
    const T two = power_remainder(of.s, -2.0 / 3, of.a * of.a);
    const T i1 = first_excess(of);
    const T i2 = 3 * two - of.second - 2 * of.third + (two - of.s * (2.0 / 3)) * (2 * of.first + of.second);
    return law.c10 * i1 + law.c01 * i2 + 0.5 * law.bulk * g.change * g.change;
  }

  // P [Pa]. Needs J > 0.
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress(const Law& law, const Kinematics<T>& g) {
    const T a = inverse_cube_root(g.jacobian * g.jacobian);
    const Matrix<T> tau = kirchhoff(law, left_strain(g.h), a, law.bulk * g.change * g.jacobian);
    return by_inverse_transpose(tau, g);
  }

  // dP of F that changes by `d` [Pa].
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress_change(const Law& law, const Matrix<T>& h, const Matrix<T>& d) {
    const Kinematics<T> g = kinematics(h);
    const Matrix<T> e = left_strain(h), squared = product(e, e);
    const T a = inverse_cube_root(g.jacobian * g.jacobian);
    const Matrix<T> tau = kirchhoff(law, e, a, law.bulk * g.change * g.jacobian);
    const Matrix<T> l = velocity_gradient(g, d);
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
};

}  // namespace
}  // namespace flexel::simulate::laws
