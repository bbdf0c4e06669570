// The distance of two surfaces, against shapes whose distance is known and against points strewn densely.
#include "flexel/study/runs/hausdorff.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/sanitized.h"

namespace flexel::study {
namespace {

using Corners = std::array<std::uint32_t, 3>;

struct Sheet {
  std::vector<Vec3> vertices;
  std::vector<Corners> triangles;
};

// n x n squares over [0, 1]^2, each cut in two.
Sheet sheet(std::uint32_t n) {
  Sheet made;
  for (std::uint32_t j = 0; j <= n; ++j)
    for (std::uint32_t i = 0; i <= n; ++i) made.vertices.emplace_back(1.0 * i / n, 1.0 * j / n, 0);
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t at = j * (n + 1) + i;
      made.triangles.push_back({at, at + 1, at + n + 2});
      made.triangles.push_back({at, at + n + 2, at + n + 1});
    }
  return made;
}

std::vector<Vec3> moved(const Sheet& from, const std::function<Vec3(const Vec3&)>& by) {
  std::vector<Vec3> result;
  for (const Vec3& each : from.vertices) result.push_back(each + by(each));
  return result;
}

double distance(const Sheet& from, const std::function<Vec3(const Vec3&)>& by) {
  return hausdorff_distance(from.vertices, moved(from, by), from.triangles);
}

TEST(Hausdorff, OfNoChangeIsNothing) {
  EXPECT_EQ(distance(sheet(4), [](const Vec3&) { return Vec3::Zero().eval(); }), 0);
  EXPECT_EQ(hausdorff_distance({}, {}, {}), 0);
}

TEST(Hausdorff, OfAShiftAcrossIsTheShift) {
  const double found = distance(sheet(5), [](const Vec3&) { return Vec3(0, 0, 0.1); });
  EXPECT_GE(found, 0.1 - 1e-12);
  EXPECT_LE(found, 0.1 * (1 + study::kHausdorffMargin) + 1e-12);
}

// What slides within its own plane differs at the rim alone, by less than its vertices move.
TEST(Hausdorff, OfSlidingIsLessThanTheVerticesMove) {
  const auto slide = [](const Vec3& at) {
    const double inside = 16 * at.x() * (1 - at.x()) * at.y() * (1 - at.y());
    return Vec3(0.1 * inside, 0.07 * inside, 0.001 * inside);
  };
  const double found = distance(sheet(less_if_sanitized(8, 4, "a quarter of the triangles")), slide);
  EXPECT_GE(found, 0.0009);
  EXPECT_LE(found, 0.001 * (1 + study::kHausdorffMargin));
}

// A sheet that is folded down along one diagonal, and up along the other: all corners are the same points.
TEST(Hausdorff, IsFoundBetweenVertices) {
  const std::vector<Vec3> valley = {{0, 0, 0}, {1, 0, 0.3}, {1, 1, 0}, {0, 1, 0.3}};
  const std::vector<Vec3> ridge = {valley[1], valley[2], valley[3], valley[0]};
  const std::vector<Corners> triangles = {{0, 1, 2}, {0, 2, 3}};
  const double known = 0.3 * std::cos(std::atan(0.3 / std::sqrt(0.5)));  // from the middle, across a slope
  const double found = hausdorff_distance(valley, ridge, triangles);
  EXPECT_GE(found, known - 1e-12);
  EXPECT_LE(found, known * (1 + study::kHausdorffMargin) + 1e-12);
}

double from_dense_points(const std::vector<Vec3>& from, const std::vector<Vec3>& to,
                         const std::vector<Corners>& triangles, int n) {
  const auto strewn = [&](const std::vector<Vec3>& at) {
    std::vector<Vec3> points;
    for (const Corners& t : triangles)
      for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j)
          points.emplace_back((at[t[0]] * i + at[t[1]] * j + at[t[2]] * (n - i - j)) / n);
    return points;
  };
  const std::vector<Vec3> p = strewn(from), q = strewn(to);
  const auto side = [](const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double most = 0;
    for (const Vec3& each : a) {
      double least = 1e300;
      for (const Vec3& other : b) least = std::min(least, (each - other).squaredNorm());
      most = std::max(most, least);
    }
    return std::sqrt(most);
  };
  return std::max(side(p, q), side(q, p));
}

TEST(Hausdorff, AgreesWithDensePoints) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> noise(-0.25, 0.25);
  for (int trial = 0; trial < 4; ++trial) {
    const Sheet plain = sheet(2);
    const std::vector<Vec3> rough =
        moved(plain, [&](const Vec3&) { return Vec3(noise(random), noise(random), noise(random)); });
    const double found = hausdorff_distance(plain.vertices, rough, plain.triangles);
    const int n = 24;  // points at most 0.7 sqrt(2) / 24 / sqrt(3) from any other point of a triangle
    EXPECT_NEAR(found, from_dense_points(plain.vertices, rough, plain.triangles, n), 0.03);
  }
}

TEST(Hausdorff, TrianglesWithoutAreaDoNoHarm) {
  Sheet plain = sheet(3);
  plain.triangles.push_back({0, 1, 1});
  plain.triangles.push_back({0, 1, 2});  // on a line
  const double found = distance(plain, [](const Vec3& at) { return Vec3(0, 0, 0.2 * at.x()); });
  EXPECT_GE(found, 0.2 - 1e-12);
  EXPECT_LE(found, 0.2 * (1 + study::kHausdorffMargin));
  EXPECT_EQ(hausdorff_distance(plain.vertices, plain.vertices, {{Corners{0, 1, 2}}}), 0);
}

}  // namespace
}  // namespace flexel::study
