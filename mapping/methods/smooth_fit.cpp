// The entries of M are monomials of degree four at most: 35 different sums, not 100. M is factored as L D L^T
// without pivots, which a positive definite matrix does not need; the ridge keeps it so.
#include "mapping/methods/smooth_fit.h"

#include <array>

#include "base/simd.h"
#include "mapping/anchors/blend_weights.h"

namespace flexel::mapping {
namespace {

using namespace simd;

constexpr double kQuadraticRidge = 1e-6, kLinearRidge = 1e-9;
constexpr int kTerms = 10, kMoments = 35;

// Exponents of x, y, z: by degree, so that the terms are the first ten.
using Exponents = std::array<int, 3>;
constexpr std::array<Exponents, kMoments> list_exponents() {
  std::array<Exponents, kMoments> list{};
  int n = 0;
  for (int degree = 0; degree <= 4; ++degree)
    for (int x = degree; x >= 0; --x)
      for (int y = degree - x; y >= 0; --y) list[n++] = {x, y, degree - x - y};
  return list;
}
constexpr std::array<Exponents, kMoments> kExponents = list_exponents();

constexpr int number_of(const Exponents& wanted) {
  for (int n = 0; n < kMoments; ++n)
    if (kExponents[n] == wanted) return n;
  return -1;
}
constexpr std::array<std::array<int, kTerms>, kTerms> number_products() {
  std::array<std::array<int, kTerms>, kTerms> table{};
  for (int i = 0; i < kTerms; ++i)
    for (int j = 0; j < kTerms; ++j)
      table[i][j] = number_of({kExponents[i][0] + kExponents[j][0], kExponents[i][1] + kExponents[j][1],
                               kExponents[i][2] + kExponents[j][2]});
  return table;
}
constexpr std::array<std::array<int, kTerms>, kTerms> kProduct = number_products();

// Which moment, times which coordinate, gives each.
struct Step {
  int from, axis;
};
constexpr std::array<Step, kMoments> list_steps() {
  std::array<Step, kMoments> steps{};
  for (int n = 1; n < kMoments; ++n) {
    Exponents lower = kExponents[n];
    int axis = 2;
    while (lower[axis] == 0) --axis;
    --lower[axis];
    steps[n] = {number_of(lower), axis};
  }
  return steps;
}
constexpr std::array<Step, kMoments> kSteps = list_steps();

FLEXEL_INLINE Lanes weight_of(const SmoothNeighbour& neighbour, const Lanes* away,
                              const SmoothPoints& points) {
  const Lanes r =
      square_root(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]) * (1 / kSmoothRadius);
  const Lanes left = r < 1 ? 1 - r : Lanes{};
  const Lanes square = left * left;
  Lanes weight = square * square * (4 * r + 1);
  if (neighbour.from != 0xff) {
    Lanes share{};
    for (unsigned a = 0; a < 8; ++a)
      if (neighbour.from >> a & 1u) share += load_as<Lanes>(points.share[a]);
    weight *= share;
  }
  return weight;
}

FLEXEL_INLINE void find_away(const SmoothNeighbour& neighbour, const Lanes* at, Lanes* away) {
  for (int axis = 0; axis < 3; ++axis) away[axis] = neighbour.at[axis] - at[axis];
}

// The coefficients a, from the moments, for lanes whose moment 0 is above zero; anything for others.
FLEXEL_INLINE void solve(const Lanes* moments, Lanes* a) {
  const Lanes scale = moments[0] > 0 ? moments[0] : Lanes{} + 1;
  const Lanes inverse_scale = 1 / scale;
  Lanes lower[kTerms][kTerms], inverse_pivot[kTerms];
  for (int j = 0; j < kTerms; ++j) {
    Lanes scaled[kTerms];  // of row j, times the pivots
    Lanes pivot = moments[kProduct[j][j]] * inverse_scale;
    if (j > 0) pivot += j < 4 ? kLinearRidge : kQuadraticRidge;
    for (int k = 0; k < j; ++k) {
      scaled[k] = lower[j][k];
      lower[j][k] = scaled[k] * inverse_pivot[k];
      pivot -= lower[j][k] * scaled[k];
    }
    inverse_pivot[j] = 1 / pivot;
    for (int i = j + 1; i < kTerms; ++i) {
      Lanes entry = moments[kProduct[i][j]] * inverse_scale;
      for (int k = 0; k < j; ++k) entry -= lower[i][k] * lower[j][k];
      lower[i][j] = entry;  // times the pivot, until its own row comes
    }
  }
  Lanes y[kTerms];
  y[0] = Lanes{} + 1;
  for (int i = 1; i < kTerms; ++i) {
    y[i] = Lanes{};
    for (int k = 0; k < i; ++k) y[i] -= lower[i][k] * y[k];
  }
  for (int i = kTerms - 1; i >= 0; --i) {
    a[i] = y[i] * inverse_pivot[i];
    for (int k = i + 1; k < kTerms; ++k) a[i] -= lower[k][i] * a[k];
  }
  for (int i = 0; i < kTerms; ++i) a[i] *= inverse_scale;
}

}  // namespace

FLEXEL_CLONES void fit_quadratics(const SmoothNeighbour* neighbours, std::size_t count,
                                  const SmoothPoints& points, std::vector<double>& weights, SmoothFit& fit) {
  static_assert(kSmoothLanes == kLanes);
  if (weights.size() < count * kLanes) weights.resize(count * kLanes);
  double* weight = weights.data();
  Lanes at[3], away[3], moments[kMoments]{};
  for (int axis = 0; axis < 3; ++axis) at[axis] = load_as<Lanes>(points.at[axis]);
  for (std::size_t i = 0; i < count; ++i) {
    find_away(neighbours[i], at, away);
    Lanes monomial[kMoments];
    monomial[0] = weight_of(neighbours[i], away, points);
    __builtin_memcpy(weight + i * kLanes, &monomial[0], sizeof monomial[0]);
    moments[0] += monomial[0];
#pragma GCC unroll 40
    for (int n = 1; n < kMoments; ++n) {
      monomial[n] = monomial[kSteps[n].from] * away[kSteps[n].axis];
      moments[n] += monomial[n];
    }
  }
  Lanes a[kTerms];
  solve(moments, a);
  Lanes value{}, rest[3]{}, displacement[3]{};
  for (std::size_t i = 0; i < count; ++i) {
    const SmoothNeighbour& neighbour = neighbours[i];
    find_away(neighbour, at, away);
    Lanes term[kTerms], polynomial = a[0];
    term[0] = Lanes{} + 1;
#pragma GCC unroll 10
    for (int n = 1; n < kTerms; ++n) {
      term[n] = kSteps[n].from == 0 ? away[kSteps[n].axis] : term[kSteps[n].from] * away[kSteps[n].axis];
      polynomial += a[n] * term[n];
    }
    const Lanes c = load_as<Lanes>(weight + i * kLanes) * polynomial;
    value += c;
    for (int axis = 0; axis < 3; ++axis) {
      rest[axis] += c * neighbour.rest[axis];
      displacement[axis] += c * neighbour.displacement[axis];
    }
  }
  __builtin_memcpy(fit.weight, &moments[0], sizeof moments[0]);
  __builtin_memcpy(fit.value, &value, sizeof value);
  __builtin_memcpy(fit.rest, rest, sizeof rest);
  __builtin_memcpy(fit.displacement, displacement, sizeof displacement);
}

}  // namespace flexel::mapping
