// Arruda and Boyce (1993), compressible, for rubber whose chains come to an end; CalculiX's *HYPERELASTIC, ARRUDA-BOYCE
// with D = 2/K. With q = I1' / (3 lambda_m^2), the square of the share of its length that a chain is drawn to,
//     dW/dI1' = mu/6 g(q),   g = L^-1(sqrt q) / sqrt q = 2/(1 - q) + 1 - q/5 - 2 q^2/5,
// Kroeger's approximant of the inverse of Langevin's function (2015), within 0.3 % of it for every q < 1. (The series of
// five terms in other programs has no end: at q = 0.41 it is 1 % below, at 0.66 12 %.) With d = q - q0, q0 = 1 / lambda_m^2,
//     W = mu lambda_m^2 / 2 [-2 ln((1 - q)/(1 - q0)) + d - (2 q0 d + d^2)/10 - 2/15 (3 q0^2 d + 3 q0 d^2 + d^3)] + K/2 (J - 1)^2
// At small strain the shear modulus is mu g(q0) / 3, the bulk modulus K. Kirchhoff's stress is
//     tau = mu/3 g a dev e + K (J - 1) J I,   e = b - I,  a = J^-2/3,
// and the change of I1' by l = dF F^-1 is 2 a dev(e) : l: no term cancels at small strains.
#pragma once
#include "simulate/laws/isochoric.h"
#include "simulate/laws/law.h"

namespace flexel::simulate::laws {
namespace {

struct ArrudaBoyce {
  // 1 - q: what a chain is short of its length. Nothing bears 0 or less.
  template <class T>
  FLEXEL_INLINE static T reserve(const Law& law, const Kinematics<T>& g) {
    return reserve(law, isochoric(g, left_strain(g.h)));
  }

  // J/m^3; infinity where chains would be longer than they are. Needs J > 0.
  template <class T>
  FLEXEL_INLINE static T energy(const Law& law, const Matrix<T>& h) {
    const Kinematics<T> g = kinematics(h);
    const T excess = first_excess(isochoric(g, left_strain(h)));
    const double q0 = 1 / law.links;
    const T d = excess * (q0 / 3), left = excess * (-1 / (3 * law.links - 3));
    const T drawn = d - 0.1 * d * (2 * q0 + d) - (2.0 / 15) * d * (3 * q0 * (q0 + d) + d * d);
    const T inside = left > -1 ? left : T{} - 0.5;  // any number that has a logarithm
    const T chains = 0.5 * law.chains * law.links * (drawn - 2 * logarithm(inside));
    const T swollen = 0.5 * law.bulk * g.change * g.change;
    return left > -1 ? chains + swollen : T{} + __builtin_huge_val();
  }

  // P [Pa]. Needs J > 0; beyond the length of the chains a finite number that says nothing.
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress(const Law& law, const Kinematics<T>& g) {
    const Matrix<T> e = left_strain(g.h);
    const Isochoric<T> of = isochoric(g, e);
    const T slope = slope_of(reserve(law, of));
    return by_inverse_transpose(kirchhoff(law, e, slope * of.a, law.bulk * g.change * g.jacobian), g);
  }

  // dP of F that changes by `d` [Pa].
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress_change(const Law& law, const Matrix<T>& h, const Matrix<T>& d) {
    const Kinematics<T> g = kinematics(h);
    const Matrix<T> e = left_strain(h), even = deviator(e), l = velocity_gradient(g, d);
    const Isochoric<T> of = isochoric(g, e);
    const T left = finite(reserve(law, of)), slope = slope_of(left);
    const T curvature = 2 / (left * left) - 0.2 - 0.8 * (1 - left);  // dg/dq
    T drawn = T{};                                                   // dI1'
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) drawn += 2 * of.a * even.at[i][j] * l.at[i][j];
    const T swelling = trace(l);
    Matrix<T> de = product(l, e);  // l b + b l^T, b = I + e
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) de.at[i][j] += l.at[i][j];
    de = deviator(twice_symmetric(de));
    const T stiffer = curvature * drawn * (1 / (3 * law.links)) - (2.0 / 3) * slope * swelling;
    const T pressure = law.bulk * (2 * g.jacobian - 1) * g.jacobian * swelling;
    const Matrix<T> tau = kirchhoff(law, e, slope * of.a, law.bulk * g.change * g.jacobian);
    const Matrix<T> carried = product_transposed(tau, l);
    Matrix<T> sum;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        sum.at[i][j] = (law.chains / 3) * of.a * (slope * de.at[i][j] + stiffer * even.at[i][j]) +
                       (i == j ? pressure : T{}) - carried.at[i][j];
    return by_inverse_transpose(sum, g);
  }

  // g of 1 - q
  template <class T>
  FLEXEL_INLINE static T slope_of(const T& reserve) {
    const T left = finite(reserve), q = 1 - left;
    return 2 / left + 1 - 0.2 * q - 0.4 * q * q;
  }

 private:
  template <class T>
  FLEXEL_INLINE static T reserve(const Law& law, const Isochoric<T>& of) {
    return (1 - 1 / law.links) - first_excess(of) * (1 / (3 * law.links));
  }

  template <class T>
  FLEXEL_INLINE static T finite(const T& reserve) {
    return reserve > 1e-9 ? reserve : T{} + 1e-9;
  }

  template <class T>
  FLEXEL_INLINE static Matrix<T> kirchhoff(const Law& law, const Matrix<T>& e, const T& stiffness,
                                           const T& pressure) {
    Matrix<T> tau = deviator(e);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) tau.at[i][j] *= (law.chains / 3) * stiffness;
    for (int i = 0; i < 3; ++i) tau.at[i][i] += pressure;
    return tau;
  }

  FLEXEL_INLINE static double logarithm(double y) { return __builtin_log1p(y); }
  FLEXEL_INLINE static simd::Lanes logarithm(const simd::Lanes& y) { return simd::log1p(y); }
};

}  // namespace
}  // namespace flexel::simulate::laws
