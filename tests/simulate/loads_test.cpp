// Loads as engineers give them: their resultants, and reactions that balance
// forces and moments.
#include "simulate/effects/loads.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "simulate/matter/load_distribution.h"
#include "simulate/matter/surface_points.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

struct Sums {
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
};

Sums sums(const std::vector<LoadedPoint>& points, const std::vector<Vec3>& forces) {
  Sums result;
  for (std::size_t q = 0; q < points.size(); ++q)
    add_at(forces[q], points[q].position, result.force, result.moment);
  return result;
}

std::vector<LoadedPoint> scattered() {
  std::vector<LoadedPoint> points;
  for (int i = 0; i < 40; ++i)
    points.push_back(
        {Vec3(std::sin(1.0 + i), std::cos(2.0 * i), std::sin(3.0 * i + 0.5)), 1 + 0.5 * std::sin(5.0 * i)});
  return points;
}

TEST(LoadDistribution, AveragingLinkIsStaticallyEquivalent) {
  const std::vector<LoadedPoint> points = scattered();
  const Vec3 force(3, -2, 5), moment(-1, 4, 2), at(10, 20, -5);
  const Sums found = sums(points, *averaging_link(points, force, moment, at));
  EXPECT_LT((found.force - force).norm(), 1e-12 * force.norm());
  EXPECT_LT((found.moment - moment - at.cross(force)).norm(), 1e-12 * at.cross(force).norm());
}

TEST(LoadDistribution, ForceAtTheMiddleIsEven) {
  const std::vector<LoadedPoint> points = scattered();
  double total = 0;
  for (const LoadedPoint& point : points) total += point.weight;
  const std::vector<Vec3> forces = *averaging_link(points, Vec3(1, 2, 3), Vec3::Zero(), std::nullopt);
  for (std::size_t q = 0; q < points.size(); ++q)
    EXPECT_LT((forces[q] - points[q].weight / total * Vec3(1, 2, 3)).norm(), 1e-14);
}

TEST(LoadDistribution, PointsOnALineTakeNoMomentAboutIt) {
  std::vector<LoadedPoint> line;
  for (int i = 0; i < 5; ++i) line.push_back({Vec3(i, 0, 0), 1});
  EXPECT_FALSE(averaging_link(line, Vec3::Zero(), Vec3(1, 0, 0), std::nullopt));
  const auto bent = averaging_link(line, Vec3::Zero(), Vec3(0, 0, 1), std::nullopt);
  ASSERT_TRUE(bent);
  EXPECT_LT((sums(line, *bent).moment - Vec3(0, 0, 1)).norm(), 1e-12);
}

std::vector<LoadedPoint> hole(int around, double turned) {
  std::vector<LoadedPoint> points;
  for (int i = 0; i < around; ++i) {
    const double angle = turned + 2 * M_PI * i / around;
    const Vec3 out(std::cos(angle), std::sin(angle), 0);
    points.push_back({0.01 * out, 1e-6, -out});
  }
  return points;
}

TEST(LoadDistribution, BearingPressureFallsWithTheCosine) {
  const std::vector<LoadedPoint> points = hole(720, 0);
  const std::vector<Vec3> forces = *bearing(points, Vec3(100, 0, 0));
  EXPECT_LT((sums(points, forces).force - Vec3(100, 0, 0)).norm(), 1e-10);
  for (std::size_t q = 0; q < points.size(); ++q) {
    const double cosine = points[q].position.x() / 0.01;
    EXPECT_NEAR(forces[q].norm(), cosine > 0 ? forces[0].norm() * cosine : 0, 1e-9);
  }
  // An uneven face still gets the whole force.
  EXPECT_LT((sums(hole(7, 0.3), *bearing(hole(7, 0.3), Vec3(0, -5, 0))).force - Vec3(0, -5, 0)).norm(),
            1e-12);
  EXPECT_FALSE(bearing(points, Vec3(0, 0, 1)));  // along the axis
}

// Few points for many: the same area, the same first moments, the same weight at every element; and each
// still lies where its weights say, so that what is statically equivalent at the points is so at the
// elements.
TEST(Loads, GatheredPointsSumUpToAllPoints) {
  testing::BoxOptions options{.cells = {14, 12, 3}, .spacing = Vec3(.01, .012, .009)};
  options.axes = Eigen::AngleAxisd(0.5, Vec3(1, 2, 0.5).normalized()).toRotationMatrix();
  options.fill = [](int i, int j, int) { return i == 5 && j > 3 ? 0. : 1.; };  // points beside the matter
  const Body body = testing::box_body(options);
  const Problem problem{body, {}, {}, {}, {}, {}};
  std::vector<std::uint32_t> polygons(body.surface.polygon_count());
  std::iota(polygons.begin(), polygons.end(), 0u);
  const std::vector<SurfacePoint> all = surface_points(problem, polygons);
  const std::vector<SurfacePoint> few = gathered_surface_points(problem, polygons);
  EXPECT_LT(10 * few.size(), all.size());
  struct Sum {
    Vec3 area = Vec3::Zero(), moment = Vec3::Zero();
    std::vector<double> weights;
  };
  const auto sum = [&](const std::vector<SurfacePoint>& points) {
    Sum result;
    result.weights.assign(body.element_count(), 0);
    for (const SurfacePoint& point : points) {
      const double area = point.area_vector.norm();
      result.area += point.area_vector.cwiseAbs();
      result.moment += area * point.position;
      for (std::size_t a = 0; a < point.at.count; ++a)
        result.weights[point.at.elements[a]] += area * point.at.weights[a];
    }
    return result;
  };
  const Sum expected = sum(all), found = sum(few);
  EXPECT_LT((found.area - expected.area).norm(), 1e-12 * expected.area.norm());
  EXPECT_LT((found.moment - expected.moment).norm(), 1e-12 * expected.area.norm());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    EXPECT_NEAR(found.weights[e], expected.weights[e], 1e-12 * expected.area.norm());
  for (const SurfacePoint& point : few) {
    Vec3 there = Vec3::Zero();
    for (std::size_t a = 0; a < point.at.count; ++a)
      there += point.at.weights[a] * body.rest[point.at.elements[a]];
    EXPECT_LT((there - point.position).norm(), 1e-12);
  }
}

struct LoadCase {
  const char* name;
  const char* load;
};

// A turned bar under each kind of load, by far enough to bend it: loads and
// reactions balance where it is.
TEST(Loads, ReactionsBalanceForcesAndMoments) {
  const std::vector<LoadCase> all = {
      {"force", "force = [\"3 N\", \"-2 N\", \"5 N\"]"},
      {"pressure", "pressure = \"40 kPa\""},
      {"torque", "torque = [\"0.2 N m\", \"0 N m\", \"0.1 N m\"]"},
      {"remote",
       "force = [\"1 N\", \"2 N\", \"-1 N\"]\nat = [\"100 mm\", \"30 "
       "mm\", \"-20 mm\"]"},
      {"remote with torque",
       "force = [\"1 N\", 0, 0]\nat = [0, \"30 mm\", "
       "0]\ntorque = [0, 0, \"0.1 N m\"]"},
  };
  for (const LoadCase& each : less_if_sanitized(all, {all[1], all[4]}, "two loads of five")) {
    testing::BoxOptions options{.cells = {10, 3, 3}, .spacing = Vec3::Constant(0.005)};
    options.axes = Eigen::AngleAxisd(0.5, Vec3(1, 2, 0.5).normalized()).toRotationMatrix();
    Body body = testing::box_body(options);
    const Scene scene =
        parse_scene(std::string("material = \"rubber\"\n[[fix]]\nwhere = \"box/x0\"\n[[load]]\n"
                                "where = \"box/x1\"\n") +
                        each.load + "\n[gravity]\nacceleration = [0, \"1 m/s2\", \"-9.81 m/s2\"]\n",
                    "s.toml");
    Progress progress("test", Progress::Mode::quiet);
    SimulateOptions how;
    how.estimate = false;
    const SimulateResult result = simulate(body, scene, how, progress);
    double force = 0, moment = 0;
    for (const Reaction& reaction : result.reactions) {
      force += reaction.force.norm();
      moment += reaction.moment.norm();
    }
    EXPECT_GT(result.largest_displacement, 1e-4) << each.name;
    EXPECT_LT(result.imbalance.norm(), 1e-6 * force) << each.name;
    EXPECT_LT(result.moment_imbalance.norm(), 1e-6 * moment) << each.name;
  }
}

// A small torque twists a square bar by T L / (G J), J = 0.1406 a^4 (Saint-Venant); eight cells are 3 % too
// stiff (material_test_test.cpp).
TEST(Loads, TorqueTwistsABar) {
  constexpr int n = 8;
  Body body = testing::box_body({.cells = {4 * n, n, n}, .spacing = Vec3::Constant(0.01 / n)});
  const Scene scene = parse_scene(
      "material = \"steel\"\n[[fix]]\nwhere = \"xmin\"\n[[load]]\nwhere = "
      "\"xmax\"\ntorque = [\"1 N m\", 0, 0]\n",
      "s");
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions how;
  how.estimate = false;
  const SimulateResult result = simulate(body, scene, how, progress);
  EXPECT_LT((result.loads[0].moment - Vec3(1, 0, 0)).norm(), 1e-6);
  // Twist per length away from both ends.
  const auto turned = [&](int i) {
    for (std::size_t e = 0; e < body.element_count(); ++e)
      if (body.lattice_index[e] == Index3{i, n, n / 2}) return (body.position[e] - body.rest[e]).z() / 0.005;
    return 0.0;
  };
  const double twist = (turned(3 * n) - turned(n)) / 0.02;
  EXPECT_NEAR(twist * (210e9 / 2.6) * 0.140577 * 1e-8, 1, 0.04);
}

TEST(Loads, RefusesWhatDoesNotFit) {
  const auto message = [](const std::string& load) -> std::string {
    try {
      Body body = testing::box_body();
      const Scene scene =
          parse_scene("material = \"steel\"\n[[fix]]\nwhere = \"box/x0\"\n[[load]]\n" + load, "s.toml");
      Progress progress("test", Progress::Mode::quiet);
      (void)simulate(body, scene, {}, progress);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message("where = \"box/x1\"\nat = [0, 0, 0]\ntorque = [\"1 N m\", 0, 0]\n"),
              HasSubstr("\"at\""));
  EXPECT_THAT(message("where = \"box/x1\"\nbearing = [0, 0, 0]\n"), HasSubstr("no direction"));
  EXPECT_THAT(message("where = \"box/x1\"\nbearing = [\"1 N\", 0, 0]\n"), HasSubstr("does not look against"));
  EXPECT_THAT(message("where = \"box\"\nbearing = [\"1 N\", 0, 0]\n"), HasSubstr("needs a face"));
  EXPECT_THAT(message("where = \"box/x1\"\npressure = \"1 Pa\"\ntorque = [\"1 "
                      "N m\", 0, 0]\n"),
              HasSubstr("either"));
}

}  // namespace
}  // namespace flexel::simulate
