// Interpolation at Greville's abscissae. The error of a surface is measured along its lines of nodes, one direction
// after the other, so that each is refined where it needs it; then between the nodes of both.
#include "cad/fit/fit.h"

#include <BSplCLib.hxx>
#include <BSplSLib.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <algorithm>

namespace flexel::cad {
namespace {

constexpr int kMostRounds = 16;
constexpr std::size_t kMostCurveSpans = 1600, kMostSurfaceSpans = 400, kMostPoles = 60'000;

TColStd_Array1OfReal reals(const std::vector<double>& values) {
  TColStd_Array1OfReal array(1, static_cast<Standard_Integer>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    array.SetValue(static_cast<Standard_Integer>(i) + 1, values[i]);
  return array;
}

TColStd_Array1OfInteger integers(const std::vector<int>& values) {
  TColStd_Array1OfInteger array(1, static_cast<Standard_Integer>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    array.SetValue(static_cast<Standard_Integer>(i) + 1, values[i]);
  return array;
}

Handle(Geom_BSplineCurve)
    interpolate(const std::function<gp_XYZ(double)>& map, const Knots& knots, bool closed) {
  const std::vector<double> nodes = knots.greville();
  const auto n = static_cast<Standard_Integer>(nodes.size());
  TColStd_Array1OfInteger contact(1, n);
  contact.Init(0);
  TColgp_Array1OfPnt poles(1, n);
  for (Standard_Integer i = 1; i <= n; ++i) poles(i) = gp_Pnt(map(nodes[i - 1]));
  if (closed) poles(n) = poles(1);
  Standard_Integer problem = 0;
  const TColStd_Array1OfReal flat = reals(knots.flat()), parameters = reals(nodes);
  BSplCLib::Interpolate(kDegree, flat, parameters, contact, poles, problem);
  if (problem != 0) return {};
  return new Geom_BSplineCurve(poles, reals(knots.at), integers(knots.multiplicity), kDegree);
}

Handle(Geom_BSplineSurface) interpolate(const SurfaceMap& map, const Knots& u, const Knots& v) {
  const std::vector<double> nodes_u = u.greville(), nodes_v = v.greville();
  const auto n = static_cast<Standard_Integer>(nodes_u.size()),
             m = static_cast<Standard_Integer>(nodes_v.size());
  TColgp_Array2OfPnt poles(1, n, 1, m);
  for (Standard_Integer i = 1; i <= n; ++i)
    for (Standard_Integer j = 1; j <= m; ++j) poles(i, j) = gp_Pnt(map.point(nodes_u[i - 1], nodes_v[j - 1]));
  if (map.u_closed)
    for (Standard_Integer j = 1; j <= m; ++j) poles(n, j) = poles(1, j);
  if (map.v_closed)
    for (Standard_Integer i = 1; i <= n; ++i) poles(i, m) = poles(i, 1);
  Standard_Integer problem = 0;
  BSplSLib::Interpolate(kDegree, kDegree, reals(u.flat()), reals(v.flat()), reals(nodes_u), reals(nodes_v),
                        poles, problem);
  if (problem != 0) return {};
  return new Geom_BSplineSurface(poles, reals(u.at), reals(v.at), integers(u.multiplicity),
                                 integers(v.multiplicity), kDegree, kDegree);
}

// The errors of a surface, by span of each direction.
struct SpanErrors {
  std::vector<double> u, v;
  [[nodiscard]] double largest() const {
    return std::max(*std::max_element(u.begin(), u.end()), *std::max_element(v.begin(), v.end()));
  }
};

class ErrorGauge {
 public:
  ErrorGauge(const SurfaceMap& map, const Handle(Geom_BSplineSurface) & surface, const Knots& u,
             const Knots& v)
      : map_(map), surface_(surface), u_(u), v_(v) {}

  // Along the lines of nodes, thinned where there are many.
  [[nodiscard]] SpanErrors on_lines() const {
    const double du = (u_.at.back() - u_.at.front()) / static_cast<double>(u_.spans()),
                 dv = (v_.at.back() - v_.at.front()) / static_cast<double>(v_.spans());
    return {along_lines(
                u_, v_, [&](double u, double v, double width) { return map_.counts(u, v, width, dv); },
                [&](double u, double v) { return error(u, v); }),
            along_lines(
                v_, u_, [&](double v, double u, double width) { return map_.counts(u, v, du, width); },
                [&](double v, double u) { return error(u, v); })};
  }

  // At four points of every rectangle of knots.
  [[nodiscard]] SpanErrors between() const {
    SpanErrors errors = none();
    for (std::size_t a = 0; a < u_.spans(); ++a)
      for (std::size_t b = 0; b < v_.spans(); ++b)
        for (int corner = 0; corner < 4; ++corner) {
          const double du = u_.at[a + 1] - u_.at[a], dv = v_.at[b + 1] - v_.at[b];
          const double u = u_.at[a] + du * (corner & 1 ? 0.71 : 0.29),
                       v = v_.at[b] + dv * (corner & 2 ? 0.71 : 0.29);
          if (!map_.counts(u, v, du, dv)) continue;
          const double found = error(u, v);
          errors.u[a] = std::max(errors.u[a], found);
          errors.v[b] = std::max(errors.v[b], found);
        }
    return errors;
  }

 private:
  // Of each span of `knots`, on the lines at nodes of the other direction; counts(at, line, width of the span).
  template <class Counts, class Error>
  [[nodiscard]] static std::vector<double> along_lines(const Knots& knots, const Knots& across,
                                                       const Counts& counts, const Error& error_at) {
    constexpr std::size_t kMostLines = 60;
    constexpr int kPoints = kDegree + 1;  // a span
    const std::vector<double> lines = across.greville();
    const std::size_t every = 1 + lines.size() / kMostLines;
    std::vector<double> errors(knots.spans());
    for (std::size_t s = 0; s < knots.spans(); ++s) {
      const double begin = knots.at[s], width = knots.at[s + 1] - knots.at[s];
      for (std::size_t line = 0; line < lines.size(); line += every)
        // All points of a span in a row: OpenCASCADE keeps the polynomial of the last one.
        for (int q = 0; q < kPoints; ++q)
          if (const double at = begin + width * (q + 0.5) / kPoints; counts(at, lines[line], width))
            errors[s] = std::max(errors[s], error_at(at, lines[line]));
    }
    return errors;
  }
  [[nodiscard]] SpanErrors none() const {
    return {std::vector<double>(u_.spans()), std::vector<double>(v_.spans())};
  }
  [[nodiscard]] double error(double u, double v) const {
    return (surface_.Value(u, v).XYZ() - map_.point(u, v)).Modulus();
  }
  const SurfaceMap& map_;
  GeomAdaptor_Surface surface_;
  const Knots &u_, &v_;
};

// Refines the knots; false: they are good enough, or cannot be refined further. `fit` gets what was reached.
bool refine(const SurfaceMap& map, Knots& u, Knots& v, double tolerance, SurfaceFit& fit) {
  constexpr double kShare = 0.6;  // of the tolerance, for one direction
  const ErrorGauge gauge(map, fit.surface, u, v);
  const SpanErrors lines = gauge.on_lines();
  fit.error = lines.largest();
  const bool full = u.greville().size() * v.greville().size() > kMostPoles;
  if (fit.error > kShare * tolerance && !full) {
    const bool u_split = split_spans(u, lines.u, kShare * tolerance, kMostSurfaceSpans);
    const bool v_split = split_spans(v, lines.v, kShare * tolerance, kMostSurfaceSpans);
    return u_split || v_split;
  }
  const SpanErrors between = gauge.between();
  fit.error = std::max(fit.error, between.largest());
  fit.reached = fit.error <= tolerance;
  if (fit.reached || full) return false;
  const bool u_first =
      *std::max_element(lines.u.begin(), lines.u.end()) >= *std::max_element(lines.v.begin(), lines.v.end());
  return u_first ? split_spans(u, between.u, tolerance, kMostSurfaceSpans)
                 : split_spans(v, between.v, tolerance, kMostSurfaceSpans);
}

}  // namespace

CurveFit fit_curve(const std::function<gp_XYZ(double t)>& map, Knots knots, bool closed, double tolerance) {
  constexpr int kPoints = 2 * kDegree + 1;  // a span
  CurveFit fit;
  for (int round = 0; round < kMostRounds; ++round) {
    const Handle(Geom_BSplineCurve) curve = interpolate(map, knots, closed);
    if (curve.IsNull()) return fit;
    fit.curve = curve;
    std::vector<double> errors(knots.spans());
    for (std::size_t s = 0; s < knots.spans(); ++s)
      for (int q = 0; q < kPoints; ++q) {
        const double t = knots.at[s] + (knots.at[s + 1] - knots.at[s]) * (q + 0.5) / kPoints;
        errors[s] = std::max(errors[s], (curve->Value(t).XYZ() - map(t)).Modulus());
      }
    fit.error = *std::max_element(errors.begin(), errors.end());
    fit.reached = fit.error <= tolerance;
    if (fit.reached || !split_spans(knots, errors, tolerance, kMostCurveSpans)) break;
  }
  return fit;
}

SurfaceFit fit_surface(const SurfaceMap& map, Knots u, Knots v, double tolerance) {
  SurfaceFit fit;
  for (int round = 0; round < kMostRounds; ++round) {
    const Handle(Geom_BSplineSurface) surface = interpolate(map, u, v);
    if (surface.IsNull()) return fit;
    fit.surface = surface;
    if (!refine(map, u, v, tolerance, fit)) break;
  }
  return fit;
}

}  // namespace flexel::cad
