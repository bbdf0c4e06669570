// Orthotropic elasticity, Saint Venant and Kirchhoff's law with nine constants, for wood, prints and laminates;
// CalculiX's *ELASTIC, TYPE=ENGINEERING CONSTANTS with large deflection:
//     W = 1/2 E : C : E,   E = 1/2 (F^T F - I),   S = C : E,   P = F S
// C is the inverse of the compliance with 1/E_i, -nu_ij/E_i and 1/G_ij in the material's axes, turned into the
// frame of F. For moderate strains: the law is not polyconvex, and under compression along an axis below a
// stretch of 1/sqrt(3) it gets softer the more it is pressed.
#pragma once
#include "simulate/laws/law.h"
#include "simulate/laws/tensor.h"

namespace flexel::simulate::laws {
namespace {

struct Orthotropic {
  // C : e; `e` symmetric.
  template <class T>
  FLEXEL_INLINE static Matrix<T> by_moduli(const Law& law, const Matrix<T>& e) {
    const T strain[6] = {e.at[0][0], e.at[1][1], e.at[2][2], 2 * e.at[0][1], 2 * e.at[1][2], 2 * e.at[2][0]};
    T s[6];
    for (int i = 0; i < 6; ++i) {
      s[i] = law.moduli[i][0] * strain[0];
      for (int j = 1; j < 6; ++j) s[i] += law.moduli[i][j] * strain[j];
    }
    return {{{s[0], s[3], s[5]}, {s[3], s[1], s[4]}, {s[5], s[4], s[2]}}};
  }

  // J/m^3
  template <class T>
  FLEXEL_INLINE static T energy(const Law& law, const Matrix<T>& h) {
    const Matrix<T> e = strain(h), s = by_moduli(law, e);
    T sum = {};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sum += e.at[i][j] * s.at[i][j];
    return 0.5 * sum;
  }

  // P [Pa]
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress(const Law& law, const Kinematics<T>& g) {
    const Matrix<T> s = by_moduli(law, strain(g.h));
    Matrix<T> p = product(g.h, s);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p.at[i][j] += s.at[i][j];
    return p;
  }

  // dP of F that changes by `d` [Pa].
  template <class T>
  FLEXEL_INLINE static Matrix<T> stress_change(const Law& law, const Matrix<T>& h, const Matrix<T>& d) {
    const Matrix<T> s = by_moduli(law, strain(h)), turned = transposed_product(h, d);
    Matrix<T> change;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        change.at[i][j] = 0.5 * (d.at[i][j] + d.at[j][i] + turned.at[i][j] + turned.at[j][i]);
    const Matrix<T> ds = by_moduli(law, change), carried = product(h, ds);
    Matrix<T> p = product(d, s);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p.at[i][j] += ds.at[i][j] + carried.at[i][j];
    return p;
  }

 private:
  template <class T>
  FLEXEL_INLINE static Matrix<T> strain(const Matrix<T>& h) {
    Matrix<T> e = transposed_product(h, h);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) e.at[i][j] = 0.5 * (e.at[i][j] + h.at[i][j] + h.at[j][i]);
    return e;
  }
};

}  // namespace
}  // namespace flexel::simulate::laws
