// Wall thickness at the vertices of shapes whose walls are known.
#include "voxelize/thickness.h"

#include <gtest/gtest.h>

#include "base/program/share_scope.h"
#include "tests/voxelize/shapes.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

TEST(Thickness, OfATurnedBoxIsItsShortestSide) {
  std::mt19937 random(7);
  const Mesh mesh = transformed(box({0, 0, 0}, {3, 2, .1}), random_rotation(random));
  for (const double t : vertex_thickness(surface(mesh))) EXPECT_NEAR(t, .1, 1e-9);
}

TEST(Thickness, OfAHollowBallIsThatOfItsWall) {
  const Mesh mesh = merged(icosphere(4, 1), inverted(icosphere(4, .8)));
  for (const double t : vertex_thickness(surface(mesh))) EXPECT_NEAR(t, .2, .005);
}

TEST(Thickness, OfAForkIsThatOfItsLeaves) {
  const Mesh mesh = fork(.1, .3, .4, 1);
  const std::vector<double> thickness = vertex_thickness(surface(mesh));
  for (std::size_t v = 0; v < thickness.size(); ++v) {
    if (mesh.vertices[v].x() > .9) {
      EXPECT_NEAR(thickness[v], .1, 1e-9);
    }
  }
}

TEST(Thickness, OfManyTrianglesTellsItsShare) {
  std::vector<double> shares;
  const ShareScope scope([&](double share) { shares.push_back(share); });
  (void)vertex_thickness(surface(icosphere(4, 1)));
  EXPECT_GE(shares.size(), 5u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GT(shares.back(), 0.5);
}

}  // namespace
}  // namespace flexel::voxelize
