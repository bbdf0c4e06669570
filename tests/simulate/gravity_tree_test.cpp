// The tree against the sum over all pairs.
#include "simulate/gravitation/gravity_tree.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>

#include "base/parallel.h"
#include "tests/sanitized.h"

namespace flexel::simulate {
namespace {

// A lattice of n^3 elements, as of a body, or as many at random in two heaps.
PointMasses lattice(int n) {
  PointMasses points;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        points.position.emplace_back(0.01 * i, 0.01 * j, 0.01 * k);
        points.mass.push_back(0.3);
        points.radius.push_back(0.005);
      }
  return points;
}

PointMasses heaps(int n) {
  std::mt19937 engine(11);
  std::normal_distribution<double> normal;
  PointMasses points;
  for (int i = 0; i < n * n * n; ++i) {
    const double far = i % 3 == 0 ? 8 : 0;
    points.position.emplace_back(normal(engine) + far, normal(engine), normal(engine));
    points.mass.push_back(1 + 0.5 * std::sin(i));
    points.radius.push_back(1e-3);
  }
  return points;
}

struct Errors {
  double field = 0, largest = 0, potential = 0, momentum = 0;
};

Errors errors_of(const PointMasses& points, const Attraction& tree, const Attraction& pairs) {
  double wrong = 0, all = 0, deep = 0, deep_wrong = 0, worst = 0, size = 0;
  Vec3 force = Vec3::Zero();
  for (std::size_t i = 0; i < points.mass.size(); ++i) {
    const double each = (tree.field[i] - pairs.field[i]).squaredNorm();
    wrong += each;
    worst = std::max(worst, each);
    all += pairs.field[i].squaredNorm();
    deep += points.mass[i] * pairs.potential[i];
    deep_wrong += points.mass[i] * (tree.potential[i] - pairs.potential[i]);
    force += points.mass[i] * tree.field[i];
    size += points.mass[i] * tree.field[i].norm();
  }
  const double rms = std::sqrt(all / static_cast<double>(points.mass.size()));
  return {std::sqrt(wrong / all), std::sqrt(worst) / rms, std::abs(deep_wrong / deep), force.norm() / size};
}

double seconds_of(const auto& work) {
  const auto began = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

// Prints the table of docs/measurements/gravity-tree.md.
TEST(GravityTree, ErrorAgainstTheSumOverPairs) {
  std::printf("points           opening  rms field  largest    energy     momentum   tree [s]  pairs [s]\n");
  const int across = less_if_sanitized(22, 14, "a quarter of the points");
  for (const bool of_body : {true, false}) {
    const PointMasses points = of_body ? lattice(across) : heaps(across);
    Attraction pairs, tree;
    const double slow = seconds_of([&] { pairs = attraction_by_pairs(points); });
    double before = 1;
    for (const double opening : {1.0, 0.7, 0.5, 0.4, 0.3}) {
      const double fast = seconds_of([&] { tree = attraction_by_tree(points, opening); });
      const Errors errors = errors_of(points, tree, pairs);
      std::printf("%zu %-10s %.1f      %.2e   %.2e   %.2e   %.2e   %.3f     %.3f\n", points.mass.size(),
                  of_body ? "lattice" : "two heaps", opening, errors.field, errors.largest, errors.potential,
                  errors.momentum, fast, slow);
      EXPECT_LT(errors.field, before);
      before = errors.field;
      if (opening > 0.4) continue;
      EXPECT_LT(errors.field, 1e-3);
      EXPECT_LT(errors.potential, 1e-4);
      EXPECT_LT(errors.momentum, 1e-13);
    }
    EXPECT_GT(before, 1e-9);  // the groups were used at all
  }
}

TEST(GravityTree, OfOneLeafIsTheSumOverPairs) {
  const PointMasses points = heaps(2);
  const Attraction tree = attraction_by_tree(points, 0.5), pairs = attraction_by_pairs(points);
  for (std::size_t i = 0; i < points.mass.size(); ++i)
    EXPECT_LT((tree.field[i] - pairs.field[i]).norm(), 1e-13 * pairs.field[i].norm());
}

TEST(GravityTree, TakesManyElementsAtOnePlace) {
  PointMasses points = heaps(5);
  for (std::size_t i = 0; i < 60; ++i) points.position[i] = Vec3(1, 2, 3);
  const Attraction tree = attraction_by_tree(points, 0.5), pairs = attraction_by_pairs(points);
  EXPECT_LT(errors_of(points, tree, pairs).field, 1e-3);
  points.position.assign(points.mass.size(), Vec3(1, 2, 3));
  for (const Vec3& field : attraction_by_tree(points, 0.5).field) EXPECT_EQ(field, Vec3::Zero());
}

TEST(GravityTree, SameBitsForAnyNumberOfThreads) {
  const PointMasses points = heaps(15);
  Attraction one, many;
  {
    const ThreadLimit limit(1);
    one = attraction_by_tree(points, 0.5);
  }
  {
    const ThreadLimit limit(2);
    many = attraction_by_tree(points, 0.5);
  }
  for (std::size_t i = 0; i < points.mass.size(); ++i) {
    ASSERT_EQ(one.field[i], many.field[i]);
    ASSERT_EQ(one.potential[i], many.potential[i]);
  }
}

}  // namespace
}  // namespace flexel::simulate
