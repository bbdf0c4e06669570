// The lattice finds the part's flat faces.
#include <gtest/gtest.h>

#include "tests/voxelize/shapes.h"
#include "voxelize/lattice/align.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

TEST(Align, ATurnedBoxBecomesWholeFullCells) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Mesh mesh = transformed(box({0, 0, 0}, {2, .7, .5}), random_rotation(random), {3, -2, 5});
    const VoxelizeResult result = run(mesh, .1, Align::snap);
    EXPECT_EQ(result.parts[0].cells, 20u * 7u * 5u) << trial;
    EXPECT_EQ(result.parts[0].dropped_cells, 0u) << trial;
    for (const double fill : result.body.fill) ASSERT_NEAR(fill, 1, 1e-6) << trial;
  }
}

// Files of merged facets have triangles with three corners in a line: they lie on no plane.
TEST(Align, TrianglesWithoutAnAreaAreNoPlane) {
  Mesh mesh = box({0, 0, 0}, {2, .7, .5});
  mesh.vertices.insert(mesh.vertices.end(), {{.5, 0, 0}, {1.5, 0, 0}});  // on the edge (0, 1)
  mesh.triangles[0] = {0, 2, 8};
  mesh.triangles.push_back({8, 2, 9});
  mesh.triangles.push_back({9, 2, 1});
  // The side on the other face of that edge still has the whole edge: slivers stand between.
  mesh.triangles.insert(mesh.triangles.end(), {{0, 8, 9}, {0, 9, 1}});
  const VoxelizeResult result = run(mesh, .1, Align::snap);
  EXPECT_EQ(result.parts[0].cells, 20u * 7u * 5u);
}

TEST(Align, WorldAxesStayExact) {
  const VoxelizeResult result = run(box({0, 0, 0}, {2, .7, .5}), .11, Align::snap);
  EXPECT_EQ(result.body.parts[0].lattice.axes, Mat3(Mat3::Identity()));
  for (int a = 0; a < 3; ++a) {
    EXPECT_LE(result.parts[0].spacing[a], 1.15 * .11);
    EXPECT_GE(result.parts[0].spacing[a], .85 * .11);
  }
  for (const double fill : result.body.fill) ASSERT_NEAR(fill, 1, 1e-9);
}

TEST(Align, AnLPutsItsInnerFacesOnPlanesToo) {
  // 60 x 60 with legs of 8, at size 4.3: 15 cells of 4 put both the outer and the inner faces on planes.
  const Mesh mesh = prism({{0, 0}, {60, 0}, {60, 8}, {8, 8}, {8, 60}, {0, 60}},
                          {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}}, 0, 40);
  const VoxelizeResult result = run(mesh, 4.3, Align::snap);
  EXPECT_NEAR(result.parts[0].spacing.x(), 4, 1e-12);
  EXPECT_NEAR(result.parts[0].spacing.y(), 4, 1e-12);
  for (const double fill : result.body.fill) ASSERT_NEAR(fill, 1, 1e-9);
}

TEST(Align, ABallKeepsTheWorldAxes) {
  std::mt19937 random(2);
  const VoxelizeResult result = run(transformed(icosphere(3, 1), random_rotation(random)), .2, Align::snap);
  EXPECT_EQ(result.body.parts[0].lattice.axes, Mat3(Mat3::Identity()));
}

TEST(Align, CentrePlacementStaysCubic) {
  std::mt19937 random(4);
  const VoxelizeResult result = run(transformed(box({0, 0, 0}, {2, .7, .5}), random_rotation(random)), .11,
                                    Align::snap, Placement::centre);
  EXPECT_EQ(result.parts[0].spacing, Vec3::Constant(.11));
}

TEST(Align, TheSameTriangleNoiseDoesNotTurnTheLattice) {
  // Single precision moves the corners of a long box by 1e-7 of its size.
  Mesh mesh = box({10.1, 20.2, 30.3}, {110.4, 27.7, 35.9});
  for (Vec3& v : mesh.vertices) v = v.cast<float>().cast<double>();
  const VoxelizeResult result = run(mesh, 1, Align::snap);
  EXPECT_EQ(result.body.parts[0].lattice.axes, Mat3(Mat3::Identity()));
  for (const double fill : result.body.fill) ASSERT_NEAR(fill, 1, 1e-6);
}

}  // namespace
}  // namespace flexel::voxelize
