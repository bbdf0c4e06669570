// B-splines of degree 5 through points of a map, refined until they are within a tolerance.
#pragma once
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <functional>
#include <gp_XYZ.hxx>

#include "cad/fit/knots.h"

namespace flexel::cad {

// What was reached: the largest error at the points that the fit looked at, and whether it is within the tolerance.
struct Fit {
  double error = 0;
  bool reached = false;
};

struct CurveFit : Fit {
  Handle(Geom_BSplineCurve) curve;  // null: there is no such curve
};

// `closed`: the last pole is the first.
[[nodiscard]] CurveFit fit_curve(const std::function<gp_XYZ(double t)>& map, Knots knots, bool closed,
                                 double tolerance);

struct SurfaceFit : Fit {
  Handle(Geom_BSplineSurface) surface;  // null: there is no such surface
};

struct SurfaceMap {
  std::function<gp_XYZ(double u, double v)> point;
  // Whether a rectangle about (u, v), `du` and `dv` to either side, counts: errors elsewhere do not.
  std::function<bool(double u, double v, double du, double dv)> counts;
  bool u_closed = false, v_closed = false;  // the last row of poles is the first
};

[[nodiscard]] SurfaceFit fit_surface(const SurfaceMap& map, Knots u, Knots v, double tolerance);

}  // namespace flexel::cad
