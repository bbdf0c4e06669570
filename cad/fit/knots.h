// Knots of a B-spline in one direction, refined where its fit is bad.
#pragma once
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

namespace flexel::cad {

// Of the B-splines that are fitted. OpenCASCADE 7.6.3 meshes a cubic sphere with holes and says nothing.
constexpr int kDegree = 5;

// Clamped: the first and the last knot have multiplicity kDegree + 1.
struct Knots {
  std::vector<double> at;         // ascending
  std::vector<int> multiplicity;  // (knots)
  [[nodiscard]] std::size_t spans() const { return at.size() - 1; }
  [[nodiscard]] std::vector<double> flat() const;      // each as often as its multiplicity
  [[nodiscard]] std::vector<double> greville() const;  // (poles) where the fit interpolates
};

// A parameter where a curve is `continuity` times continuously differentiable only.
struct Break {
  double at = 0;
  int continuity = 0;
};

// From `begin` to `end`, with a knot at every break and no span longer than a `least_spans`-th of the whole. Breaks nearer
// than `shortest` to an end have none, and those nearer to one another share one: derivatives of a span that short are
// rounding, and a curve along a surface's rim beside a pole runs through nothing else.
[[nodiscard]] Knots make_knots(double begin, double end, std::vector<Break> breaks, std::size_t least_spans,
                               double shortest = 0);

// Splits the spans whose error is above `tolerance`, each into as many (4 at most) as its error asks for, which goes
// with the power kDegree + 1 of its length. False, and nothing changes: none can be split, or there would be more than
// `most_spans`.
[[nodiscard]] bool split_spans(Knots& knots, const std::vector<double>& errors, double tolerance,
                               std::size_t most_spans);

}  // namespace flexel::cad
