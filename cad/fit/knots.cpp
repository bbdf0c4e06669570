// Greville's abscissae (W. J. Gordon and R. F. Riesenfeld, "B-spline curves and surfaces", 1974): averages of kDegree
// knots, at which interpolation is well-posed (I. J. Schoenberg and A. Whitney, 1953).
#include "cad/fit/knots.h"

#include <algorithm>
#include <cmath>

namespace flexel::cad {

std::vector<double> Knots::flat() const {
  std::vector<double> all;
  for (std::size_t i = 0; i < at.size(); ++i) all.insert(all.end(), multiplicity[i], at[i]);
  return all;
}

std::vector<double> Knots::greville() const {
  const std::vector<double> all = flat();
  std::vector<double> result(all.size() - kDegree - 1);
  for (std::size_t i = 0; i < result.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 1; j <= kDegree; ++j) sum += all[i + j];
    result[i] = sum / kDegree;
  }
  result.front() = all.front();  // without rounding
  result.back() = all.back();
  return result;
}

Knots make_knots(double begin, double end, std::vector<Break> breaks, std::size_t least_spans,
                 double shortest) {
  const double least = std::max(shortest, 1e-9 * std::max(1.0, end - begin));
  std::erase_if(breaks,
                [&](const Break& each) { return each.at <= begin + least || each.at >= end - least; });
  std::sort(breaks.begin(), breaks.end(), [](const Break& a, const Break& b) { return a.at < b.at; });
  Knots coarse{{begin}, {kDegree + 1}};
  for (const Break& each : breaks) {
    const int multiplicity = std::clamp(kDegree - each.continuity, 1, kDegree);
    if (coarse.at.size() > 1 && each.at - coarse.at.back() < least) {
      coarse.multiplicity.back() = std::max(coarse.multiplicity.back(), multiplicity);
    } else {
      coarse.at.push_back(each.at);
      coarse.multiplicity.push_back(multiplicity);
    }
  }
  coarse.at.push_back(end);
  coarse.multiplicity.push_back(kDegree + 1);
  const double longest = (end - begin) / static_cast<double>(std::max<std::size_t>(1, least_spans)) * 1.0001;
  Knots knots;
  for (std::size_t i = 0; i + 1 < coarse.at.size(); ++i) {
    knots.at.push_back(coarse.at[i]);
    knots.multiplicity.push_back(coarse.multiplicity[i]);
    const double length = coarse.at[i + 1] - coarse.at[i];
    const int pieces = static_cast<int>(std::ceil(length / longest));
    for (int j = 1; j < pieces; ++j) {
      knots.at.push_back(coarse.at[i] + length * j / pieces);
      knots.multiplicity.push_back(1);
    }
  }
  knots.at.push_back(end);
  knots.multiplicity.push_back(kDegree + 1);
  return knots;
}

bool split_spans(Knots& knots, const std::vector<double>& errors, double tolerance, std::size_t most_spans) {
  Knots split;
  const double shortest = 1e-6 * (knots.at.back() - knots.at.front());
  bool any = false;
  for (std::size_t i = 0; i < knots.spans(); ++i) {
    split.at.push_back(knots.at[i]);
    split.multiplicity.push_back(knots.multiplicity[i]);
    const double length = knots.at[i + 1] - knots.at[i];
    if (!(errors[i] > tolerance) || length <= shortest) continue;
    any = true;
    const double wanted = 1.05 * std::pow(errors[i] / tolerance, 1.0 / (kDegree + 1));
    const int pieces = static_cast<int>(std::clamp(std::ceil(wanted), 2.0, 4.0));
    for (int j = 1; j < pieces; ++j) {
      split.at.push_back(knots.at[i] + length * j / pieces);
      split.multiplicity.push_back(1);
    }
  }
  split.at.push_back(knots.at.back());
  split.multiplicity.push_back(knots.multiplicity.back());
  if (!any || split.spans() > most_spans) return false;
  knots = std::move(split);
  return true;
}

}  // namespace flexel::cad
