// Neo-Hooke (Simo and Pister 1984):
//     W = mu/2 (tr F^T F - 3 - 2 ln J) + lambda/2 ln^2 J,   P = mu (F - F^-T) + lambda ln J F^-T
// Without cancellation, with F = I + H and cof F = I + tr(H) I - H^T + cof H:
//     J (F - F^-T) = (J - 1 - tr H) I + J H + H^T - cof H.
// This header is for the kernels; neo_hooke_scalar.h has the same for one cell.
#pragma once
#include "simulate/laws/tensor.h"

namespace flexel::simulate::laws {
namespace {

// First Piola-Kirchhoff stress [Pa].
template <class T>
FLEXEL_INLINE Matrix<T> neo_hooke_stress(const Kinematics<T>& g, const T& log_volume, double mu,
                                         double lambda) {
  const T pressure = lambda * log_volume * g.inverse;
  const T shear = mu * g.inverse;
  Matrix<T> p;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      // J (F - F^-T), F^-T = cof F / J
      const T difference = g.jacobian * g.h.at[i][j] - g.less_one.at[i][j] + (i == j ? g.change : T{});
      p.at[i][j] = shear * difference + pressure * g.cofactor.at[i][j];
    }
  return p;
}

}  // namespace
}  // namespace flexel::simulate::laws
