// Patches that join: what they stand for stays, where they may not they stay apart. Runs of consecutive elements.
#include "simulate/contact/points/merged_patches.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulate/contact/pairs/element_runs.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

// A face's patch at `place`, which lies in the cell with that lower corner, of a lattice of 8 x 8 x 8 elements.
ContactPoint patch(const Vec3& place, double area, const std::array<int, 3>& cell,
                   const Vec3& normal = Vec3::UnitZ()) {
  ContactPoint point;
  point.rest = place;
  point.normal = normal;
  point.area = area;
  point.width = kSide;
  point.depth = kSide / 2;
  point.at.count = 8;
  for (unsigned a = 0; a < 8; ++a) {
    point.at.weights[a] = 1;
    std::uint32_t element = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const unsigned up = a >> axis & 1u;
      element = 8 * element + static_cast<std::uint32_t>(cell[static_cast<std::size_t>(axis)]) + up;
      const double share = place[axis] / kSide - cell[static_cast<std::size_t>(axis)];
      point.at.weights[a] *= up ? share : 1 - share;
    }
    point.at.elements[a] = element;
  }
  return point;
}

Lattice lattice() {
  return block("a", {2, 2, 2}).parts[0].lattice;
}

// Where the elements carry the point.
Vec3 carried(const ContactPoint& point) {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t a = 0; a < point.at.count; ++a) {
    const std::uint32_t e = point.at.elements[a];
    sum += point.at.weights[a] * kSide * Vec3(e % 8, e / 8 % 8, e / 64);
  }
  return sum;
}

constexpr double kCell = kSide * kSide;

TEST(MergedPatches, ASmallOneJoinsItsNeighbourOnThePlane) {
  const ContactPoint large = patch({0.014, 0.005, 0.012}, 0.7 * kCell, {1, 0, 1}),
                     small = patch({0.009, 0.005, 0.012}, 0.2 * kCell, {0, 0, 1});
  const std::vector<ContactPoint> merged = merged_patches(lattice(), {small, large});
  ASSERT_EQ(merged.size(), 1u);
  const ContactPoint& both = merged[0];
  EXPECT_NEAR(both.area, 0.9 * kCell, 1e-12 * kCell);
  const Vec3 middle = (0.7 * large.rest + 0.2 * small.rest) / 0.9;
  EXPECT_LT((both.rest - middle).norm(), 1e-12 * kSide);
  EXPECT_EQ(both.at.elements, large.at.elements);
  EXPECT_LT((carried(both) - both.rest).norm(), 1e-12 * kSide);
  double sum = 0;
  for (const double weight : both.at.weights) sum += weight;
  EXPECT_NEAR(sum, 1, 1e-12);
}

// A sphere's two places: the joined one lies on it, not on the chord.
TEST(MergedPatches, TheMeanOfACurvedSurfaceLiesOnIt) {
  constexpr double kRadius = 0.1;
  const Vec3 middle(0.01, 0.005, 0.012 - kRadius);
  const auto at = [&](double angle) { return Vec3(std::sin(angle), 0, std::cos(angle)); };
  const Vec3 one = at(-0.02), other = at(0.04);
  const std::vector<ContactPoint> merged =
      merged_patches(lattice(), {patch(middle + kRadius * one, 0.3 * kCell, {0, 0, 1}, one),
                                 patch(middle + kRadius * other, 0.6 * kCell, {1, 0, 1}, other)});
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_NEAR((merged[0].rest - middle).norm(), kRadius, 1e-5 * kRadius);  // the chord's: 2e-4
  EXPECT_LT((merged[0].normal - at(0.02)).norm(), 1e-3);
  EXPECT_NEAR(merged[0].normal.norm(), 1, 1e-12);
}

TEST(MergedPatches, WhatMayNotJoinStaysAsItIs) {
  const ContactPoint large = patch({0.014, 0.005, 0.012}, 0.7 * kCell, {1, 0, 1});
  const auto stays = [&](const ContactPoint& small) {
    const std::vector<ContactPoint> merged = merged_patches(lattice(), {small, large});
    return merged.size() == 2 && merged[0].area == small.area && merged[1].area == large.area &&
           merged[0].rest == small.rest && merged[1].rest == large.rest;
  };
  // more than a cell's face together; turned by 20 degrees; a step higher; a cell that shares an edge only
  EXPECT_TRUE(stays(patch({0.009, 0.005, 0.012}, 0.4 * kCell, {0, 0, 1})));
  EXPECT_TRUE(
      stays(patch({0.009, 0.005, 0.012}, 0.2 * kCell, {0, 0, 1}, {std::sin(0.35), 0, std::cos(0.35)})));
  EXPECT_TRUE(stays(patch({0.009, 0.005, 0.0145}, 0.2 * kCell, {0, 0, 1})));
  EXPECT_TRUE(stays(patch({0.009, 0.012, 0.012}, 0.2 * kCell, {0, 1, 1})));
  EXPECT_TRUE(merged_patches(lattice(), {}).empty());
}

TEST(MergedPatches, TheAreaOfATurnedBlockStays) {
  const auto area = [](const Body& body) {
    double sum = 0;
    for (const ContactPoint& point : contact_points(problem_of(body), {1}, 1))
      if (point.shape == ContactShape::face) sum += point.area;
    return sum;
  };
  // a cube of 24 mm inside a lattice that it crosses at an angle
  const Mat3 axes = turn(0.5, Vec3(1, 2, 3));
  const Vec3 middle = Vec3::Constant(0.025);
  std::vector<Vec3> corners;
  for (int a = 0; a < 8; ++a)
    corners.push_back(middle + axes * (0.012 * Vec3(a & 1 ? 1 : -1, a & 2 ? 1 : -1, a & 4 ? 1 : -1)));
  const Body body =
      within_block(block("a", {5, 5, 5}), corners,
                   {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}});
  EXPECT_NEAR(area(body), 6 * 0.024 * 0.024, 1e-9 * kCell);
}

TEST(ElementRuns, CoverTheListAndStayWithinParts) {
  Body body = block("a", {2, 2, 2});  // 27 elements each
  append(body, block("b", {2, 2, 2}));
  const std::vector<std::uint32_t> elements{0, 1, 2, 5, 25, 26, 27, 28, 40, 53};
  const std::vector<ElementRun> runs = element_runs(elements, body.parts);
  std::vector<std::uint32_t> listed;
  std::size_t place = 0;
  for (const ElementRun& run : runs) {
    EXPECT_EQ(run.place, place);
    for (std::uint32_t n = 0; n < run.count; ++n) {
      listed.push_back(run.first + n);
      EXPECT_GE(run.first + n, body.parts[run.part].element_begin);
      EXPECT_LT(run.first + n, body.parts[run.part].element_end);
    }
    place += run.count;
  }
  EXPECT_EQ(listed, elements);
  EXPECT_EQ(runs.size(), 6u);  // 0-2, 5, 25-26 | 27-28, 40, 53
  EXPECT_TRUE(element_runs({}, body.parts).empty());
}

TEST(ElementRuns, GatherAndCompareEveryBit) {
  Body body = block("a", {2, 2, 2});
  const std::vector<std::uint32_t> elements{1, 2, 3, 7, 20, 21};
  const std::vector<ElementRun> runs = element_runs(elements, body.parts);
  std::vector<Vec3> values;
  for (int e = 0; e < 27; ++e) values.emplace_back(e, 0.5 * e, -e);
  std::vector<Vec3> listed(elements.size());
  gather(runs, values, listed);
  for (std::size_t n = 0; n < elements.size(); ++n) EXPECT_EQ(listed[n], values[elements[n]]);
  EXPECT_TRUE(same_bits(runs, values, listed));
  values[5].x() = 1e9;  // is not listed
  EXPECT_TRUE(same_bits(runs, values, listed));
  values[21].z() = std::nextafter(values[21].z(), 0);
  EXPECT_FALSE(same_bits(runs, values, listed));
}

TEST(ElementRuns, AWideBoxIsTheBox) {
  std::vector<Vec3> values, from;
  for (int e = 0; e < 7; ++e) {
    values.emplace_back(std::sin(3. * e), std::cos(5. * e), std::sin(7. * e));
    from.emplace_back(std::cos(2. * e), std::sin(e), 0.1 * e);
  }
  for (std::size_t count = 1; count <= values.size(); ++count) {
    WideBox wide, differences;
    wide.add({values.data(), count});
    differences.add_differences({values.data(), count}, {from.data(), count});
    Box box, of_differences;
    for (std::size_t e = 0; e < count; ++e) box.add(values[e]), of_differences.add(values[e] - from[e]);
    EXPECT_EQ(wide.box().min, box.min);
    EXPECT_EQ(wide.box().max, box.max);
    EXPECT_EQ(differences.box().min, of_differences.min);
    EXPECT_EQ(differences.box().max, of_differences.max);
  }
}

}  // namespace
}  // namespace flexel::simulate
