// The arithmetic of error bars; the coarse runs are in simulate/estimate/error_bars.cpp.
#include "simulate/result/estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexel::simulate {
namespace {

constexpr double kSafety = 1.25, kWideSafety = 3;
// Of stresses of a field: measured (bench/accuracy/stresses.py).
constexpr double kGrowingSafety = 2.25, kDoubtSafety = 1.5;
constexpr double kLeastOrder = 0.5, kModelOrder = 2, kSuspiciousOrder = 2.1;
constexpr int kOrderIterations = 50;
constexpr double kHardlyDiffer = 1e-3;  // stresses, relative

// p with e32 / e21 = (r32^p - 1) / (r21^p - 1) r21^p, by fixed-point iteration (Celik et al. 2008).
double observed_order(double e21, double e32, const std::array<double, 2>& ratio) {
  double p = std::log(e32 / e21) / std::log(ratio[0]);
  for (int i = 0; i < kOrderIterations; ++i) {
    const double q = std::abs(ratio[0] - ratio[1]) < 1e-9
                         ? 0
                         : std::log((std::pow(ratio[0], std::max(p, 0.1)) - 1) /
                                    (std::pow(ratio[1], std::max(p, 0.1)) - 1));
    p = (std::log(e32 / e21) + q) / std::log(ratio[0]);
  }
  return p;
}

}  // namespace

Bar wide_bar(const Sequence& s) {
  const double largest = std::max(std::abs(s.value[1] - s.value[0]), std::abs(s.value[2] - s.value[1]));
  return {kWideSafety * largest, s.value[0], std::nullopt};
}

Bar richardson(const Sequence& s) {
  const double e21 = s.value[1] - s.value[0], e32 = s.value[2] - s.value[1];
  if (e21 == 0 && e32 == 0) return {0, s.value[0], std::nullopt};
  if (!(e21 * e32 > 0)) return wide_bar(s);
  const double order = observed_order(e21, e32, s.ratio);
  if (!(order >= kLeastOrder)) return wide_bar(s);
  const double away = -e21 / (std::pow(s.ratio[0], std::min(order, kModelOrder)) - 1);
  if (order <= kSuspiciousOrder) return {kSafety * std::abs(away), s.value[0] + away, order};
  // Values that close in faster than the model's order may be about to pass the limit, or agree by chance:
  // the coarser difference says how large the finer one should be.
  const double expected = std::abs(e32) / std::pow(s.ratio[0], kModelOrder);
  return {std::max(kWideSafety * std::abs(away), expected), s.value[0] + away, order};
}

std::optional<Bar> stress_bar(const Sequence& s, bool singular) {
  const double e21 = s.value[1] - s.value[0], e32 = s.value[2] - s.value[1];
  if (std::max(std::abs(e21), std::abs(e32)) <= kHardlyDiffer * std::abs(s.value[0])) return wide_bar(s);
  if (singular) return std::nullopt;
  Bar bar = richardson(s);
  if (!bar.order) return std::nullopt;
  bar.half_width = std::max(kWideSafety * std::abs(bar.extrapolated - s.value[0]), std::abs(e21));
  // At the surface, where the largest stress mostly is, it is carried out of cells: values that close in faster than
  // that may have met by chance.
  constexpr double kSurfaceOrder = 1;
  if (*bar.order > kSuspiciousOrder)
    bar.half_width = std::max(bar.half_width, std::abs(e32) / std::pow(s.ratio[0], kSurfaceOrder));
  return bar;
}

std::optional<Bar> field_stress_bar(const Sequence& s, std::size_t lattices, double doubt, bool singular) {
  const double e21 = std::abs(s.value[1] - s.value[0]), e32 = std::abs(s.value[2] - s.value[1]);
  if (singular && std::max(e21, e32) > kHardlyDiffer * std::abs(s.value[0])) return std::nullopt;
  // A notch of a cell or two: the peak begins to show, and the values are not near a limit yet.
  const bool grows = s.value[0] > s.value[1] && s.value[1] > s.value[2] &&
                     e21 * std::log(s.ratio[1]) > e32 * std::log(s.ratio[0]);
  // Of lattices less than twice as coarse: what a step to one twice as coarse would differ by, at least at order 1.
  const double finer = e21 / std::min(1.0, s.ratio[0] - 1);
  const double lattice =
      lattices < 3 ? kWideSafety * e21
                   : std::max((grows ? kGrowingSafety : 1) * finer, e32 / std::pow(s.ratio[0], kModelOrder));
  return Bar{std::max(lattice, kDoubtSafety * doubt), s.value[0], std::nullopt};
}

}  // namespace flexel::simulate
