// Surfaces that are inside out, inconsistently oriented, interpenetrating or open.
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/sanitized.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/classify/axis_parity.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

TEST(Broken, InsideOutIsTakenTheOtherWayRound) {
  const Mesh ball = icosphere(2, 1);
  const VoxelizeResult result = run(inverted(ball), .2);
  EXPECT_EQ(result.parts[0].healing.inverted_shells, 1u);
  EXPECT_NEAR(total_volume(result) / volume(ball), 1, 1e-9);
}

TEST(Broken, AHollowBallInsideOutStaysHollow) {
  const Mesh hollow = merged(icosphere(2, 1), inverted(icosphere(2, .6)));
  const VoxelizeResult result = run(inverted(hollow), .1);
  EXPECT_EQ(result.parts[0].healing.inverted_shells, 2u);
  EXPECT_NEAR(total_volume(result) / volume(hollow), 1, 1e-9);
}

TEST(Broken, FlippedTrianglesAreTurnedBack) {
  std::mt19937 random(9);
  const Mesh ball = icosphere(3, 1);
  Mesh mesh = ball;
  std::size_t flipped = 0;
  for (auto& t : mesh.triangles)
    if (random() % 10 == 0) {
      std::swap(t[1], t[2]);
      ++flipped;
    }
  const VoxelizeResult result = run(mesh, .15);
  EXPECT_TRUE(result.parts[0].closed);
  EXPECT_EQ(result.parts[0].healing.flipped_facets, flipped);
  EXPECT_NEAR(total_volume(result) / volume(ball), 1, 1e-9);
}

TEST(Broken, InterpenetratingBoxesHaveTheirUnionsVolume) {
  std::mt19937 random(13);
  for (int trial = 0; trial < 6; ++trial) {
    const Mesh cross =
        transformed(merged(box({0, 0, 0}, {3, 1, 1}), box({1, -1, .2}, {2, 2, .7})), random_rotation(random));
    const VoxelizeResult result = run(cross, .13);
    EXPECT_GT(result.parts[0].overlapping_voxels, 0u);
    EXPECT_NEAR(total_volume(result), 3 + 1.5 - .5, 1e-3) << trial;
    EXPECT_EQ(component_count(result.body), 1u) << trial;
  }
}

TEST(Broken, AlignedInterpenetratingBoxesAreExact) {
  const VoxelizeResult result = run(merged(box({0, 0, 0}, {3, 1, 1}), box({1, -1, .25}, {2, 2, .75})), .25);
  EXPECT_NEAR(total_volume(result), 4, 1e-9);
  EXPECT_EQ(result.parts[0].dropped_cells, 0u);
}

// Of every cell, with faces on lattice planes and between them: all are multiples of 1/64 of a cell, which lines resolve.
TEST(Broken, CellsOfInterpenetratingBoxesHaveTheFillOfTheirUnion) {
  std::mt19937 random(14);
  const auto eighths = [&](int least, int most) {
    std::uniform_int_distribution<int> range(least, most);
    Vec3 made;
    for (double& each : made) each = range(random) / 8.;
    return made;
  };
  const auto common = [](const Vec3& low, const Vec3& high, const Vec3& cell) {
    return (high.cwiseMin(cell + Vec3::Ones()) - low.cwiseMax(cell)).cwiseMax(0).prod();
  };
  int seen = 0;
  const int trials = less_if_sanitized(60, 20, "a third of the boxes");
  for (int trial = 0; trial < trials; ++trial) {
    const Vec3 a = eighths(0, 8), b = eighths(4, 16);
    const Vec3 to_a = a + eighths(6, 24), to_b = b + eighths(6, 24);
    const VoxelizeResult result = run(merged(box(a, to_a), box(b, to_b)), 1);
    const Body& body = result.body;
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
      const Vec3& cell = body.rest[body.cell_elements[c][0]];
      const double both = common(a.cwiseMax(b), to_a.cwiseMin(to_b), cell);
      if (both == 0) continue;  // two pieces perhaps
      ++seen;
      EXPECT_NEAR(body.fill[c], common(a, to_a, cell) + common(b, to_b, cell) - both, 1e-9)
          << trial << " " << cell.transpose();
    }
  }
  EXPECT_GT(seen, 2 * trials);
}

// Walls that pass through corners of the lattice, at 45 degrees.
TEST(Broken, AShellWithinAnotherChangesNothing) {
  const auto prism = [](double half, double low, double high) {
    Mesh mesh = box({-1, -1, low}, {1, 1, high});
    for (Vec3& v : mesh.vertices) v = Vec3(half * (v.x() + v.y()) / 2, half * (v.y() - v.x()) / 2, v.z());
    return mesh;
  };
  const Body alone = run(prism(3, 0, 2.5), 1).body;
  for (const double inner : {1., 1.5, 2.}) {
    const Body nested = run(merged(prism(3, 0, 2.5), prism(inner, .25, 2)), 1).body;
    ASSERT_EQ(nested.cell_count(), alone.cell_count());
    for (std::uint32_t c = 0; c < alone.cell_count(); ++c)
      EXPECT_NEAR(nested.fill[c], alone.fill[c], .01) << inner;
  }
}

TEST(Broken, TouchingBoxesHangTogether) {
  std::mt19937 random(17);
  for (int trial = 0; trial < 10; ++trial) {
    const Mat3 rotation = trial == 0 ? Mat3(Mat3::Identity()) : random_rotation(random);
    const Mesh stack =
        transformed(merged(box({0, 0, 0}, {1, 1, .5}), box({0, 0, .5}, {1, 1, 1.2})), rotation);
    const VoxelizeResult result = run(stack, .13);
    EXPECT_NEAR(total_volume(result), 1.2, 1e-6) << trial;
    EXPECT_EQ(component_count(result.body), 1u) << trial;
  }
}

// One closed shell that passes through itself: winding numbers from below 0 to above 1.
TEST(Broken, SelfIntersectingShellsNeverHoldLessThanNothing) {
  std::mt19937 random(23);
  std::normal_distribution<double> noise(0, .35);
  std::size_t impossible = 0;
  const int trials = less_if_sanitized(2, 1, "one shell of two");
  for (int trial = 0; trial < trials; ++trial) {
    Mesh crumpled = trial % 2 == 0 ? icosphere(2, 1) : torus(1, .3, 24, 12);
    for (Vec3& vertex : crumpled.vertices) vertex += Vec3(noise(random), noise(random), noise(random));
    for (const double size : {.1, .3}) {
      const VoxelizeResult result = run(crumpled, size);
      const VoxelizedPart& part = result.parts[0];
      const double voxel = part.spacing.prod();
      EXPECT_GE(part.dropped_volume, 0) << trial << " at " << size;
      EXPECT_LE(part.dropped_volume, static_cast<double>(part.dropped_cells) * voxel / 64 + 1e-6 * voxel);
      for (const double fill : result.body.fill) {
        EXPECT_GE(fill, 1. / 64);
        EXPECT_LE(fill, 1);
      }
      impossible += part.overlapping_voxels;
    }
  }
  EXPECT_GT(impossible, 125u * static_cast<unsigned>(trials));  // the shells do pass through themselves
}

TEST(Broken, VotingOnAClosedMeshIsNearTheExactFill) {
  std::mt19937 random(29);
  const Mesh mesh = transformed(torus(1, .3, 41, 23), random_rotation(random));
  PartMesh part = part_meshes(surface(mesh))[0];
  Lattice lattice;
  lattice.spacing = Vec3::Constant(.1);
  place_on_lattice(part, lattice);
  double sum = 0;
  std::size_t disagreements = 0;
  for (const Slab& slab : classify_open(part).slabs) {
    for (const Piece& piece : slab.pieces) sum += piece.fill;
    disagreements += slab.disagreements;
  }
  EXPECT_EQ(disagreements, 0u);
  EXPECT_NEAR(sum * 1e-3 / volume(mesh), 1, 2e-3);
}

TEST(Broken, ASheetEnclosesNothing) {
  Mesh sheet = box({0, 0, 0}, {1, 1, 1});
  sheet.triangles.resize(2);
  EXPECT_THROW(run(sheet, .1), InputError);
}

TEST(Broken, ASizeThatFitsNothingIsRefused) {
  EXPECT_THROW(run(icosphere(1, 1), 5), InputError);
  EXPECT_THROW(run(icosphere(1, 1), 0), InputError);
  EXPECT_THROW(run(icosphere(1, 1), 1e-12), InputError);
}

}  // namespace
}  // namespace flexel::voxelize
