// The grid finds what a look at every element finds, for points inside, outside and far away, in any shape of
// part.
#include "mapping/anchors/nearest.h"

#include <gtest/gtest.h>

#include <random>

#include "bodies.h"

namespace flexel::mapping {
namespace {

double brute_force(const Body& body, std::uint32_t part, const Vec3& point) {
  double best = 1e300;
  for (std::uint32_t e = body.parts[part].element_begin; e < body.parts[part].element_end; ++e)
    best = std::min(best, (body.rest[e] - point).norm());
  return best;
}

void compare(const Body& body, std::uint32_t part, double reach, int points) {
  const ElementGrid grid(body, part);
  std::mt19937 random(7);
  const Box box = bounding_box(body.rest);
  std::uniform_real_distribution<double> anywhere(-reach, 1 + reach);
  for (int i = 0; i < points; ++i) {
    const Vec3 share(anywhere(random), anywhere(random), anywhere(random));
    const Vec3 point = box.min + share.cwiseProduct(box.size()) + Vec3::Constant(1e-3 * anywhere(random));
    const std::uint32_t found = grid.nearest(point);
    ASSERT_GE(found, body.parts[part].element_begin);
    ASSERT_LT(found, body.parts[part].element_end);
    EXPECT_NEAR((body.rest[found] - point).norm(), brute_force(body, part, point), 1e-12 * (1 + reach));
  }
}

Lattice turned() {
  Lattice lattice;
  lattice.axes = test::rotation(0.7, Vec3(1, 0.6, 0.3));
  lattice.origin = Vec3(3, -2, 1);
  lattice.spacing = Vec3(0.09, 0.1, 0.115);
  return lattice;
}

TEST(Nearest, AgreesWithBruteForceInATurnedBall) {
  const Lattice lattice = turned();
  const Vec3 middle = lattice.to_world(Vec3(8, 8, 8));
  for (const Placement placement : {Placement::corner, Placement::centre})
    for (const double reach : {0.0, 0.3, 50.0})
      compare(test::make_body(
                  lattice, {0, 0, 0}, {16, 16, 16}, [&](const Vec3& p) { return (p - middle).norm() < 0.7; },
                  placement),
              0, reach, 1500);
}

TEST(Nearest, AgreesWithBruteForceInSparseAndDegenerateParts) {
  // A thin diagonal rod, a hollow shell, one layer, one row, one element.
  const Lattice lattice = turned();
  const auto along = [&](double r) {
    return [&lattice, r](const Vec3& p) {
      const Vec3 u = lattice.to_lattice(p);
      return (u - u.mean() * Vec3::Ones()).norm() < r;
    };
  };
  compare(test::make_body(lattice, {0, 0, 0}, {60, 60, 60}, along(0.9), Placement::centre), 0, 0.2, 800);
  const Vec3 middle = lattice.to_world(Vec3(12, 12, 12));
  compare(test::make_body(
              lattice, {0, 0, 0}, {24, 24, 24},
              [&](const Vec3& p) { return std::abs((p - middle).norm() - 1.0) < 0.1; }, Placement::centre),
          0, 0.2, 800);
  for (const Index3& size : {Index3{12, 9, 1}, Index3{17, 1, 1}, Index3{1, 1, 1}})
    compare(test::make_body(
                lattice, {0, 0, 0}, size, [](const Vec3&) { return true; }, Placement::centre),
            0, 2.0, 500);
}

TEST(Nearest, LooksAtItsOwnPartOnly) {
  Body body = test::block(4, 4, 4, 0.1, Placement::centre);
  test::append_body(body, test::block(3, 3, 3, 0.1, Placement::centre));
  compare(body, 0, 1.0, 300);
  compare(body, 1, 1.0, 300);
}

}  // namespace
}  // namespace flexel::mapping
