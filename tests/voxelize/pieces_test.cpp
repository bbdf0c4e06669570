// What is apart stays apart, what hangs together stays together, however thin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/voxelize/shapes.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

// Components of cells that lie under polygons of the two meshes that `mesh` was merged from.
void expect_apart(const Mesh& a, const Mesh& b, double size, const std::string& what) {
  const VoxelizeResult result = run(merged(a, b), size);
  std::uint32_t count = 0;
  const std::vector<std::uint32_t> component = components(result.body, count);
  std::set<std::uint32_t> of_a, of_b;
  for (std::size_t p = 0; p < result.body.surface.polygon_count(); ++p)
    for (std::uint32_t n = result.body.surface_cell_offsets[p]; n < result.body.surface_cell_offsets[p + 1];
         ++n)
      for (const std::uint32_t e : result.body.cell_elements[result.body.surface_cells[n]])
        (p < a.triangles.size() ? of_a : of_b).insert(component[e]);
  for (const std::uint32_t c : of_a) EXPECT_FALSE(of_b.contains(c)) << what;
  EXPECT_EQ(of_a.size(), 1u) << what;
  EXPECT_EQ(of_b.size(), 1u) << what;
  EXPECT_EQ(count, 2u) << what;
  EXPECT_EQ(result.parts[0].undecided_voxels, 0u) << what;
  EXPECT_EQ(result.parts[0].overlapping_voxels, 0u) << what;
}

TEST(Pieces, TwoLeavesThreeTenthsOfACellApartStayTwo) {
  const double h = .1;
  std::mt19937 random(11);
  for (int trial = 0; trial < 40; ++trial) {
    const Mat3 rotation = trial == 0 ? Mat3(Mat3::Identity()) : random_rotation(random);
    const double leaf = trial % 2 == 0 ? .8 * h : 2.3 * h;
    const Mesh a = transformed(box({0, 0, 0}, {1, .6, leaf}), rotation);
    const Mesh b = transformed(box({0, 0, leaf + .3 * h}, {1, .6, 2 * leaf + .3 * h}), rotation);
    expect_apart(a, b, h, "trial " + std::to_string(trial));
  }
}

TEST(Pieces, TheGapMayLieInsideOneLayerOrAcrossALatticePlane) {
  const double h = .1;
  for (const double bottom :
       {.25, .3, .5, .7, .85, .9, .99, 1.})  // of the gap, in cells above a lattice plane
    expect_apart(box({0, 0, 0}, {1, .6, (2 + bottom) * h}),
                 box({0, 0, (2 + bottom + .3) * h}, {1, .6, 5 * h}), h, "gap at " + std::to_string(bottom));
}

TEST(Pieces, AForkJoinedAtItsBaseIsOne) {
  const double h = .1;
  std::mt19937 random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const Mat3 rotation = trial == 0 ? Mat3(Mat3::Identity()) : random_rotation(random);
    const VoxelizeResult result = run(transformed(fork(.8 * h, .3 * h, .25, .5), rotation), h);
    EXPECT_EQ(component_count(result.body), 1u) << trial;
    EXPECT_TRUE(trial == 0 || result.parts[0].split_voxels > 20) << trial;
    EXPECT_EQ(result.parts[0].undecided_voxels, 0u) << trial;
  }
}

TEST(Pieces, AThinTurnedPlateStaysWhole) {
  const double h = .1;
  std::mt19937 random(23);
  for (int trial = 0; trial < 20; ++trial) {
    const Mesh plate = transformed(box({0, 0, 0}, {1, .7, .1 * h}), random_rotation(random));
    const VoxelizeResult result = run(plate, h);
    EXPECT_EQ(component_count(result.body), 1u) << trial;
    EXPECT_NEAR((result.parts[0].lattice_volume + result.parts[0].dropped_volume) / volume(plate), 1, 1e-9)
        << trial;
  }
}

// The way from a voxel's corner to its centre runs through the box's own corner.
TEST(Pieces, AnAlignedBoxHasAnElementInEveryVoxel) {
  for (const int n : {1, 2, 5})
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(-0.3, 0.1, 0.2)}) {
      const VoxelizeResult result = run(box(at, at + Vec3(4, 1, 1)), 1.0 / n, Align::snap, Placement::centre);
      EXPECT_EQ(result.body.element_count(), static_cast<std::size_t>(4 * n * n * n)) << n;
    }
}

TEST(Pieces, PlacedAtCentresLeavesStayTwo) {
  const double h = .1;
  std::mt19937 random(31);
  for (int trial = 0; trial < 20; ++trial) {
    const Mat3 rotation = trial == 0 ? Mat3(Mat3::Identity()) : random_rotation(random);
    const Mesh a = transformed(box({0, 0, 0}, {1, .6, 2.5 * h}), rotation);
    const Mesh b = transformed(box({0, 0, 2.8 * h}, {1, .6, 5.3 * h}), rotation);
    const VoxelizeResult result = run(merged(a, b), h, Align::none, Placement::centre);
    EXPECT_EQ(component_count(result.body), 2u) << trial;
  }
}

}  // namespace
}  // namespace flexel::voxelize
