// det(I + H) - 1 is the sum of the three invariants of H.
#include "simulate/laws/deformation.h"

#include <Eigen/LU>

namespace flexel::simulate {

double second_invariant(const Mat3& h) {
  return h(0, 0) * h(1, 1) - h(0, 1) * h(1, 0) + h(1, 1) * h(2, 2) - h(1, 2) * h(2, 1) + h(2, 2) * h(0, 0) -
         h(2, 0) * h(0, 2);
}

double volume_change(const Mat3& h) {
  return h.trace() + second_invariant(h) + h.determinant();
}

}  // namespace flexel::simulate
