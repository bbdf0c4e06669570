#include "formats/lattice/locate.h"

#include <gtest/gtest.h>

#include "tests/formats/bodies.h"

namespace flexel {
namespace {

Vec3 random_point(std::mt19937_64& random, const Lattice& lattice, double low, double high) {
  return lattice.to_world(Vec3(test::uniform(random, low, high), test::uniform(random, low, high),
                               test::uniform(random, low, high)));
}

TEST(Locate, WeightsReproduceEveryAffineFieldInsideAndBeyondTheCell) {
  std::mt19937_64 random(1);
  const Body body = test::random_body(1);
  for (int trial = 0; trial < 200; ++trial) {
    const auto cell = static_cast<std::uint32_t>(random() % body.cell_count());
    const Part& part = body.parts[cell_parts(body)[cell]];
    const Vec3 point = random_point(random, part.lattice, -3, 3);
    const CellPoint at = cell_point(body, cell, point);
    double sum = 0;
    for (const double weight : at.weights) sum += weight;
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_LT((interpolate(at, body, body.rest) - point).norm(), 1e-12);
    Mat3 matrix;
    for (int i = 0; i < 9; ++i) matrix(i) = test::uniform(random, -2, 2);
    std::vector<Vec3> values;
    for (const Vec3& rest : body.rest) values.push_back(matrix * rest + Vec3(1, 2, 3));
    EXPECT_LT((interpolate(at, body, values) - (matrix * point + Vec3(1, 2, 3))).norm(), 1e-11);
  }
}

TEST(Locate, AtACornerTheElementHasAllTheWeight) {
  const Body body = test::random_body(2);
  for (std::uint32_t cell = 0; cell < body.cell_count(); ++cell)
    for (int a = 0; a < 8; ++a) {
      const CellPoint at = cell_point(body, cell, body.rest[body.cell_elements[cell][a]]);
      for (int b = 0; b < 8; ++b) EXPECT_NEAR(at.weights[b], a == b ? 1 : 0, 1e-12);
    }
}

// Squared distance [m^2] from a point to the voxel of a cell, by clamping.
double squared_distance(const Body& body, const Lattice& lattice, std::uint32_t cell, const Vec3& point) {
  const Index3& low = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 at = lattice.to_lattice(point), corner(low[0], low[1], low[2]);
  const Vec3 nearest = at.cwiseMax(corner).cwiseMin(corner + Vec3::Ones());
  return (at - nearest).cwiseProduct(lattice.spacing).squaredNorm();
}

TEST(Locate, TheCellIsTheNearestOfThosePolygonBounds) {
  std::mt19937_64 random(3);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Body body = test::random_body(seed);
    for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
      const Part& part = body.parts[body.surface.polygon_part(p)];
      for (int trial = 0; trial < 100; ++trial) {
        const Vec3 point = random_point(random, part.lattice, -4, 6);
        const auto at = locate_on_surface(body, p, point);
        const std::uint32_t begin = body.surface_cell_offsets[p], end = body.surface_cell_offsets[p + 1];
        ASSERT_EQ(at.has_value(), begin != end);
        if (!at) continue;
        double least = INFINITY;
        bool listed = false;
        for (std::uint32_t c = begin; c < end; ++c) {
          least = std::min(least, squared_distance(body, part.lattice, body.surface_cells[c], point));
          listed |= body.surface_cells[c] == at->cell;
        }
        EXPECT_TRUE(listed);
        EXPECT_NEAR(squared_distance(body, part.lattice, at->cell, point), least, 1e-12);
      }
    }
  }
}

TEST(Locate, NothingUnderASurfaceWithoutCells) {
  Body body = test::random_body(1);
  EXPECT_FALSE(locate_on_surface(body, body.surface.polygon_count(), Vec3::Zero()).has_value());
  body.surface_cells.clear();
  body.surface_cell_offsets.clear();
  EXPECT_FALSE(locate_on_surface(body, 0, Vec3::Zero()).has_value());
}

// It tries the cell of the last point first: that must not show, whichever way the points go.
TEST(Locate, ALocatorForManyPointsFindsWhatOneForEachFinds) {
  std::mt19937_64 random(4);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Body body = test::random_body(seed);
    for (std::size_t p = 0; p < body.surface.polygon_count(); ++p) {
      const Lattice& lattice = body.parts[body.surface.polygon_part(p)].lattice;
      SurfaceLocator locate(body, p);
      Vec3 at(1, 1, 1);  // lattice coordinates; every third on faces of voxels
      for (int step = 0; step < 300; ++step) {
        at += Vec3(test::uniform(random, -.4, .4), test::uniform(random, -.4, .4),
                   test::uniform(random, -.4, .4));
        if (step % 3 == 0) at[step % 9 / 3] = std::round(at[step % 9 / 3]);
        const auto one = locate_on_surface(body, p, lattice.to_world(at)),
                   many = locate(lattice.to_world(at));
        ASSERT_EQ(one.has_value(), many.has_value());
        if (!one) continue;
        EXPECT_EQ(one->cell, many->cell);
        EXPECT_EQ(one->weights, many->weights);
      }
    }
  }
}

}  // namespace
}  // namespace flexel
