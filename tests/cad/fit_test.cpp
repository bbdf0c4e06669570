// Knots, fits and rigid motions: exact where they must be, and of the order that they promise.
#include "cad/fit/fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <gp_Ax1.hxx>
#include <gp_Dir.hxx>
#include <gp_Pnt.hxx>
#include <numbers>

#include "cad/fit/rigid_motion.h"

namespace flexel::cad {
namespace {

gp_XYZ polynomial(double t) {
  return {1 + t - 3 * t * t, std::pow(t, 5), 2 * std::pow(t, 4) - t};
}
gp_XYZ helix(double t) {
  return {std::cos(t), std::sin(t), 0.3 * t};
}

TEST(Knots, HaveEveryBreakAndNoLongSpan) {
  const Knots knots = make_knots(0, 10, {{4, 1}, {7, 0}, {4 + 1e-12, 3}}, 5);
  EXPECT_EQ(knots.at.front(), 0);
  EXPECT_EQ(knots.at.back(), 10);
  EXPECT_EQ(knots.multiplicity.front(), kDegree + 1);
  for (std::size_t i = 0; i < knots.at.size(); ++i) {
    if (i > 0) {
      EXPECT_LE(knots.at[i] - knots.at[i - 1], 2.001);
      EXPECT_GT(knots.at[i], knots.at[i - 1]);
    }
    if (std::abs(knots.at[i] - 4) < 1e-9) {
      EXPECT_EQ(knots.multiplicity[i], kDegree - 1);
    }
    if (knots.at[i] == 7) {
      EXPECT_EQ(knots.multiplicity[i], kDegree);
    }
  }
  EXPECT_EQ(knots.greville().size() + kDegree + 1, knots.flat().size());
  for (std::size_t i = 1; i < knots.greville().size(); ++i)
    EXPECT_GT(knots.greville()[i], knots.greville()[i - 1]);
}

TEST(Knots, NoBreakMakesASpanThatIsTooShort) {
  const Knots knots = make_knots(0, 10, {{0.01, 1}, {4, 3}, {4.01, 0}, {7, 1}, {9.99, 0}}, 1, 0.02);
  EXPECT_EQ(knots.at, std::vector<double>({0, 4, 7, 10}));
  EXPECT_EQ(knots.multiplicity, std::vector<int>({kDegree + 1, kDegree, kDegree - 1, kDegree + 1}));
  EXPECT_EQ(make_knots(0, 10, {{0.01, 1}, {4, 3}, {4.01, 0}, {7, 1}, {9.99, 0}}, 1, 0.001).spans(), 6u);
}

TEST(Knots, OnlyBadSpansAreSplit) {
  Knots knots = make_knots(0, 4, {}, 4);
  const Knots before = knots;
  EXPECT_FALSE(split_spans(knots, {0, 0, 0, 0}, 1e-3, 100));
  EXPECT_FALSE(split_spans(knots, {1, 1, 1, 1}, 1e-3, 5));
  EXPECT_EQ(knots.at, before.at);
  EXPECT_TRUE(split_spans(knots, {0, 1, 0, 0}, 1e-3, 100));
  for (const double at : {0.0, 1.0, 2.0, 3.0, 4.0})
    EXPECT_TRUE(std::count(knots.at.begin(), knots.at.end(), at)) << at;
  EXPECT_GT(knots.at.size(), before.at.size());
}

TEST(Fit, ACurveOfDegreeFiveIsExact) {
  const CurveFit fit = fit_curve(polynomial, make_knots(-1, 1, {}, 1), false, 1e-12);
  ASSERT_TRUE(fit.reached);
  for (double t = -1; t <= 1; t += 0.013)
    EXPECT_LT((fit.curve->Value(t).XYZ() - polynomial(t)).Modulus(), 1e-12);
}

TEST(Fit, TheErrorOfACurveGoesWithTheSixthPowerOfItsSpans) {
  const auto error = [](std::size_t spans) {
    return fit_curve(helix, make_knots(0, 6, {}, spans), false, 1).error;  // no refinement
  };
  const double ratio = error(12) / error(24);
  EXPECT_GT(ratio, 45);
  EXPECT_LT(ratio, 90);
}

TEST(Fit, ACurveIsRefinedToItsToleranceAndAKinkIsKept) {
  const auto kinked = [](double t) { return gp_XYZ(t, std::abs(t - 0.3), 0); };
  const CurveFit fit = fit_curve(kinked, make_knots(0, 1, {{0.3, 0}}, 1), false, 1e-9);
  EXPECT_TRUE(fit.reached);
  const CurveFit loose = fit_curve(helix, make_knots(0, 6, {}, 1), false, 1e-3);
  const CurveFit tight = fit_curve(helix, make_knots(0, 6, {}, 1), false, 1e-8);
  EXPECT_TRUE(loose.reached && tight.reached);
  EXPECT_GT(tight.curve->NbPoles(), loose.curve->NbPoles());
  for (double t = 0; t <= 6; t += 0.0137)
    EXPECT_LT((tight.curve->Value(t).XYZ() - helix(t)).Modulus(), 1.05e-8);
}

TEST(Fit, ASurfaceIsRefinedWhereItNeedsIt) {
  const auto wavy = [](double u, double v) { return gp_XYZ(u, v, 0.1 * std::sin(9 * u)); };
  SurfaceMap map;
  map.point = wavy;
  map.counts = [](double, double, double, double) { return true; };
  const SurfaceFit fit = fit_surface(map, make_knots(0, 2, {}, 2), make_knots(0, 2, {}, 2), 1e-6);
  ASSERT_TRUE(fit.reached);
  EXPECT_GT(fit.surface->NbUPoles(), 2 * fit.surface->NbVPoles());
  for (double u = 0; u <= 2; u += 0.071)
    for (double v = 0; v <= 2; v += 0.083)
      EXPECT_LT((fit.surface->Value(u, v).XYZ() - wavy(u, v)).Modulus(), 1.1e-6);
}

TEST(Fit, WhatDoesNotCountDoesNotRefine) {
  const auto jump = [](double u, double v) { return gp_XYZ(u, v, u > 1.6 ? 1.0 : 0.0); };
  SurfaceMap map;
  map.point = jump;
  map.counts = [](double u, double, double, double) { return u < 1; };
  const SurfaceFit fit = fit_surface(map, make_knots(0, 2, {}, 16), make_knots(0, 2, {}, 2), 1e-3);
  EXPECT_TRUE(fit.reached);
  map.counts = [](double, double, double, double) { return true; };
  EXPECT_FALSE(fit_surface(map, make_knots(0, 2, {}, 16), make_knots(0, 2, {}, 2), 1e-3).reached);
}

// A face may end in the middle of a span: what is beyond is neither asked nor told.
TEST(Fit, PointsOfASpanCountOneByOne) {
  constexpr double kEnd = 1.05;
  const Knots knots = make_knots(0, 2, {}, 4);
  const std::vector<double> nodes = knots.greville();
  const auto is_node = [&](double t) {
    return std::any_of(nodes.begin(), nodes.end(), [&](double node) { return std::abs(node - t) < 1e-12; });
  };
  std::size_t beyond = 0, within = 0;
  SurfaceMap map;
  map.point = [&](double u, double v) {
    if (!is_node(u) || !is_node(v)) ++(u < kEnd ? within : beyond);
    return gp_XYZ(u, v, 0.01 * std::sin(3 * u));
  };
  map.counts = [](double u, double, double, double) { return u < kEnd; };
  EXPECT_TRUE(fit_surface(map, knots, knots, 1).reached);  // no refinement
  EXPECT_GT(within, 100);
  EXPECT_EQ(beyond, 0);
}

TEST(RigidMotion, IsFoundAndOnlyWhereThereIsOne) {
  gp_Trsf turn, shift;
  turn.SetRotation(gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, -1, 2)), 2.9);
  shift.SetTranslation(gp_Vec(3, 4, 5));
  turn = shift * turn;
  std::vector<gp_XYZ> from, to, bent;
  for (int i = 0; i < 30; ++i) {
    from.emplace_back(i % 5, i / 5, 0);  // a plane: one singular direction
    gp_XYZ moved = from.back();
    turn.Transforms(moved);
    to.push_back(moved);
    moved.SetZ(moved.Z() + 0.01 * i * i);
    bent.push_back(moved);
  }
  const RigidMotion found = rigid_motion(from, to, 1e-9), none = rigid_motion(from, from, 1e-9);
  EXPECT_LT(found.error, 1e-12);
  EXPECT_FALSE(found.none);
  EXPECT_TRUE(none.none);
  EXPECT_LT(none.error, 1e-12);
  EXPECT_GT(rigid_motion(from, bent, 1e-9).error, 0.1);
}

}  // namespace
}  // namespace flexel::cad
