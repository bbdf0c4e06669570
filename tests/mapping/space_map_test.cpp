// The deformation as a map of space: its derivative against differences, its smoothness, and that it is what
// blended vertices follow.
#include "mapping/methods/space_map.h"

#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"
#include "motions.h"
#include "tests/sanitized.h"

namespace flexel::mapping {
namespace {

Vec3 wave(const Vec3& p) {
  return {p.x() + 0.1 * std::sin(3 * p.y()), p.y() + 0.2 * std::cos(2 * p.x()) * p.z(),
          p.z() * (1 + 0.2 * std::sin(p.x()))};
}

// A bar whose lattice is turned and has three different spacings, and a step in it (elements that not all
// corners reach).
Body stepped_body() {
  Lattice lattice;
  lattice.axes = test::rotation(0.7, Vec3(1, 0.6, 0.3));
  lattice.spacing = Vec3(0.2, 0.21, 0.19);
  lattice.origin = Vec3(0.3, -0.2, 0.1);
  Body body = test::make_body(
      lattice, {0, 0, 0}, {12, 8, 6},
      [&](const Vec3& p) {
        const Vec3 u = lattice.to_lattice(p);
        return u.z() < 2 || u.x() < 4 || (u.x() > 5 && u.y() < 3);
      },
      Placement::corner);
  test::deform(body, wave);
  return body;
}

TEST(SpaceMap, DerivativesAgreeWithDifferences) {
  const Body body = stepped_body();
  const SpaceMap map(body);
  SpaceMap::Probe probe(map);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-0.7, 1);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x =
        body.parts[0].lattice.to_world(Vec3(5 + 6 * any(random), 4 + 4 * any(random), 3 + 3 * any(random)));
    double nearest = 1e300;
    for (const Vec3& element : body.rest) nearest = std::min(nearest, (element - x).norm());
    if (nearest > 0.2) continue;  // farther than a spacing off
    const SpaceMap::Value value = probe.at(x, 0);
    Mat3 difference;
    for (int axis = 0; axis < 3; ++axis)
      difference.col(axis) = (probe.at(x + kStep * Vec3::Unit(axis), 0).position -
                              probe.at(x - kStep * Vec3::Unit(axis), 0).position) /
                             (2 * kStep);
    EXPECT_LT((difference - value.gradient).norm(), 2e-7) << x.transpose();
  }
}

// Second differences along a line through many cells: where the second derivative is continuous, neighbouring
// ones differ by an amount that shrinks with the step.
TEST(SpaceMap, SecondDerivativesAreContinuous) {
  const Body body = stepped_body();
  const SpaceMap map(body);
  SpaceMap::Probe probe(map);
  const Lattice& lattice = body.parts[0].lattice;
  const auto largest_jump = [&](const Vec3& from, const Vec3& to, int points) {
    const double step = (to - from).norm() / points;
    const Vec3 along = (to - from).normalized();
    Vec3 before = Vec3::Zero();
    double largest = 0;
    for (int i = 0; i < points; ++i) {
      const Vec3 x = from + i * step * along;
      // the derivative of the derivative, both exact to rounding
      const Mat3 second =
          (probe.at(x + step / 2 * along, 0).gradient - probe.at(x - step / 2 * along, 0).gradient) / step;
      const Vec3 now = second * along;
      if (i > 0) largest = std::max(largest, (now - before).norm());
      before = now;
    }
    return largest;
  };
  using Line = std::pair<Vec3, Vec3>;
  const Line through{Vec3(0.3, 0.4, 0.3), Vec3(11.6, 7.7, 1.8)};
  for (const auto& [from, to] :
       less_if_sanitized<std::vector<Line>>({through,
                                             {Vec3(2.1, 2.2, 0.2), Vec3(2.4, 6.3, 5.7)},
                                             {Vec3(0.5, 1.5, 1.9), Vec3(11.5, 1.7, 1.95)}},
                                            {through}, "one line of three")) {
    const double coarse = largest_jump(lattice.to_world(from), lattice.to_world(to), 4000);
    const double fine = largest_jump(lattice.to_world(from), lattice.to_world(to), 32000);
    EXPECT_LT(fine, coarse / 4) << from.transpose();
  }
}

TEST(SpaceMap, TakesVerticesWhereBlendedDoes) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::round_bar(8, placement);
    test::deform(body, test::twist);
    const std::vector<Vec3> displacement = apply(bind(body, &kBlended), body, body.position);
    const SpaceMap map(body);
    SpaceMap::Probe probe(map);
    for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
      const std::uint32_t v = body.surface.polygon(p)[0];
      const Vec3& x = body.surface.vertices[v];
      EXPECT_LT((probe.at(x, 0).position - x - displacement[v]).norm(), 1e-6);
    }
  }
}

TEST(SpaceMap, FollowsAffineMotionsFarOutToo) {
  Body body = stepped_body();
  const Mat3 shear = (Mat3() << 1.2, 0.3, 0, -0.1, 0.9, 0.2, 0.1, 0, 1.1).finished();
  const auto affine = [&](const Vec3& x) -> Vec3 { return shear * x + Vec3(1, 2, 3); };
  test::deform(body, affine);
  const SpaceMap map(body);
  SpaceMap::Probe probe(map);
  for (const double out : {0.0, 1.0, 3.0, 50.0}) {
    const Vec3 x = body.parts[0].lattice.to_world(Vec3(3.3 - out, 4.1, 1.7));
    const SpaceMap::Value value = probe.at(x, 0);
    EXPECT_LT((value.position - affine(x)).norm(), 1e-11);
    EXPECT_LT((value.gradient - shear).norm(), 1e-10);
    EXPECT_EQ(value.in_radius, out < 5);
  }
}

TEST(SpaceMap, ThePlaceIsThatWithTheGradient) {
  const Body body = stepped_body();
  const SpaceMap map(body);
  SpaceMap::Probe probe(map), other(map);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> share(-0.5, 1.5);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec3 x =
        body.parts[0].lattice.to_world(Vec3(12 * share(random), 8 * share(random), 6 * share(random)));
    const SpaceMap::Value a = probe.at(x, 0), b = other.place(x, 0);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.in_radius, b.in_radius);
    EXPECT_EQ(a.weight, b.weight);
  }
}

TEST(SpaceMap, RefusesAPartWithoutElements) {
  Body body = test::block(2, 2, 2, 0.1, Placement::corner);
  body.parts.push_back(body.parts[0]);
  body.parts[1].element_begin = body.parts[1].element_end;
  EXPECT_THROW(SpaceMap{body}, InputError);
}

}  // namespace
}  // namespace flexel::mapping
