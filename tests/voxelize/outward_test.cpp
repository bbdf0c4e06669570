// The polygons of the body's surface face out of the matter, whatever way they faced in the file.
#include "voxelize/heal/outward.h"
#include "voxelize/measure_part.h"

#include <gtest/gtest.h>

#include "base/math/area_vector.h"
#include "tests/sanitized.h"
#include "tests/voxelize/damage.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

constexpr double kRing = 1;  // radius of the torus that the tests damage

// Area [m^2] of polygons that face into the ring's tube, over that of all; fins and sheets lie elsewhere.
double share_facing_inward(const Surface& surface) {
  double inward = 0, all = 0;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const auto corners = surface.polygon(p);
    Vec3 centre = Vec3::Zero();
    for (const std::uint32_t v : corners) centre += surface.vertices[v] / static_cast<double>(corners.size());
    const Vec3 ring = kRing * Vec3(centre.x(), centre.y(), 0).normalized();
    const Vec3 area = area_vector(surface.vertices, corners);
    all += area.norm();
    if (area.dot(centre - ring) < 0) inward += area.norm();
  }
  return inward / all;
}

VoxelizeResult run_with(const Mesh& mesh, Heal heal, double size = .1) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = size;
  options.align = Align::none;
  options.heal = {heal};
  return voxelize(surface(mesh), options, progress);
}

// Damages that leave every polygon on the torus: missing, flipped, soup, cracks, repeated, and together.
TEST(Outward, PolygonsOfHealedSurfacesFaceOutward) {
  const Mesh torus = shapes::torus(kRing, .3, 48, 24);
  for (const int kind : {0, 1, 3, 4, 5, 6, 10}) {
    const Mesh broken = Damager(torus, 7).damaged(kind, .2);
    const VoxelizeResult result = run_with(broken, Heal::automatic);
    EXPECT_EQ(share_facing_inward(result.body.surface), 0) << kDamages[kind];
  }
}

TEST(Outward, PolygonsInsideAWrapFaceOutward) {
  const int around = less_if_sanitized(48, 24, "a torus of a quarter of the triangles");
  const Mesh broken = Damager(shapes::torus(kRing, .3, around, around / 2), 7).damaged(6, .2);
  const VoxelizeResult result =
      run_with(broken, Heal::wrap, less_if_sanitized(.1, .2, "cells twice as large"));
  EXPECT_TRUE(result.parts[0].healing.wrapped);
  EXPECT_EQ(share_facing_inward(result.body.surface), 0);
  EXPECT_GT(result.parts[0].healing.flipped_facets, 0u);
}

// "none" repairs nothing, but loads have to know the outside of what the vote found.
TEST(Outward, AnInconsistentSurfaceThatIsTakenAsItIsFacesOutward) {
  const VoxelizeResult result =
      run_with(Damager(shapes::torus(kRing, .3, 48, 24), 7).damaged(1, .2), Heal::none);
  EXPECT_EQ(share_facing_inward(result.body.surface), 0);
}

TEST(Outward, AVoidFacesIntoItself) {
  const Mesh hollow = merged(icosphere(2, 1), inverted(icosphere(2, .6)));
  Mesh broken = inverted(hollow);
  std::swap(broken.triangles[3][1], broken.triangles[3][2]);
  std::swap(broken.triangles[400][1], broken.triangles[400][2]);
  const Surface& after = run(broken, .1).body.surface;
  for (std::size_t t = 0; t < hollow.triangles.size(); ++t) {
    const Vec3 expected = area_vector(hollow.vertices, hollow.triangles[t]);
    ASSERT_GT(expected.dot(area_vector(after.vertices, after.polygon(t))), 0) << t;
  }
}

TEST(Outward, ATurnedPolygonKeepsItsFirstCorner) {
  Surface box = surface(shapes::box({0, 0, 0}, {1, 1, 1}));
  box.polygon_vertices = {0, 1, 3, 2, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  box.polygon_offsets = {0, 4, 8, 12, 16, 20, 24};
  box.polygon_face.assign(6, 0);
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = .25;
  const Surface after = voxelize(box, options, progress).body.surface;
  EXPECT_EQ((std::vector<std::uint32_t>{after.polygon(0).begin(), after.polygon(0).end()}),
            (std::vector<std::uint32_t>{0, 2, 3, 1}));
  for (std::size_t p = 1; p < 6; ++p)
    EXPECT_TRUE(std::equal(after.polygon(p).begin(), after.polygon(p).end(), box.polygon(p).begin())) << p;
  EXPECT_EQ(after.vertices, box.vertices);
}

TEST(Outward, MeasuresAreThoseOfTheHealedPart) {
  const Mesh ball = icosphere(3, 1);
  Surface broken = surface(inverted(Damager(ball, 5).damaged(1, .5)));
  const MeasuredPart measured = heal_and_measure(broken)[0];
  ASSERT_TRUE(measured.volume);
  EXPECT_NEAR(*measured.volume / volume(ball), 1, 1e-12);
  Surface two = surface(merged(box({0, 0, 0}, {2, 1, 1}), box({1, .2, .2}, {3, .8, .8})));
  EXPECT_NEAR(*heal_and_measure(two)[0].volume, 2 + 2 * .36 - .36, 1e-2);
}

}  // namespace
}  // namespace flexel::voxelize
