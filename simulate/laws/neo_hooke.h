// Neo-Hooke (Simo and Pister 1984):
//     W = mu/2 (tr F^T F - 3 - 2 ln J) + lambda/2 ln^2 J,   P = mu (F - F^-T) + lambda ln J F^-T
// Without cancellation, with F = I + H, cof F = I + L, L = tr(H) I - H^T + cof H:
//     P = mu H + (lambda ln J - mu) / J L + (lambda ln J + mu (J - 1)) / J I.
// This header is for the kernels; neo_hooke_scalar.h has the same for one cell.
#pragma once
#include "simulate/laws/tensor.h"

namespace flexel::simulate::laws {
namespace {

// First Piola-Kirchhoff stress [Pa].
template <class T>
FLEXEL_INLINE Matrix<T> neo_hooke_stress(const Kinematics<T>& g, const T& log_volume, double mu,
                                         double lambda) {
  const T pressure = lambda * log_volume;
  const T turned = (pressure - mu) * g.inverse, even = (pressure + mu * g.change) * g.inverse;
  Matrix<T> p;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      p.at[i][j] = mu * g.h.at[i][j] + turned * g.less_one.at[i][j];
      if (i == j) p.at[i][j] += even;
    }
  return p;
}

}  // namespace
}  // namespace flexel::simulate::laws
