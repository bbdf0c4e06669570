// One axis after the other: the values of the coarse polynomials at the box's Gauss points, times its moments.
#include "simulate/estimate/coarse_moments.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kN = kMomentPoints;

// Sums over the first index of `from`; the new one comes last, so that three turns restore the order.
void contract(const std::array<double, kMoments>& from, double low, double size,
              std::array<double, kMoments>& to) {
  constexpr std::size_t kRest = kN * kN;
  to.fill(0);
  for (std::size_t i = 0; i < kN; ++i) {
    const std::array<double, kN> value = lagrange_at(low + size * kGaussPoints[i]);
    for (std::size_t n = 0; n < kN; ++n)
      for (std::size_t rest = 0; rest < kRest; ++rest)
        to[rest + kRest * n] += size * value[n] * from[i + kN * rest];
  }
}

}  // namespace

void add_box(const double* box, const std::array<double, 3>& low, const std::array<double, 3>& size,
             double* coarse) {
  CellMoments a, b;
  for (std::size_t k = 0; k < kMoments; ++k) a[k] = box[k];
  contract(a, low[0], size[0], b);
  contract(b, low[1], size[1], a);
  contract(a, low[2], size[2], b);
  for (std::size_t k = 0; k < kMoments; ++k) coarse[k] += b[k];
}

}  // namespace flexel::simulate
