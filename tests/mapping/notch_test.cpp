// Cracks that end inside a part: the surface opens up to the crack's end and stays one closed surface.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <random>

#include "cgal_solid.h"
#include "formats/part/topology.h"
#include "mapping/crack/crack_carved.h"
#include "pieces.h"

namespace flexel::mapping {
namespace {

using namespace test;

constexpr double kOpening = 0.05;

// A bar of 9 x 4 x 3 cells, sawn from y = 0 half-way through, and bent open there.
Body notched_bar(int n) {
  Body body = block(9, 4, 3, 0.1, Placement::corner, n);
  break_cells(body, [](const Vec3& x) { return x.x() > 0.4 && x.x() < 0.5 && x.y() < 0.2; });
  deform(body, [](const Vec3& x) -> Vec3 {
    return x + Vec3(x.x() > 0.45 && x.y() < 0.15 ? kOpening * (1 - x.y() / 0.2) : 0, 0, 0);
  });
  return body;
}

// Displacements that are neither one side's nor the other's, as far as `y` goes from the notch's mouth.
std::size_t torn_between(const MappedPart& mapped, double y) {
  const Surface& surface = mapped.cracked->surface;
  std::size_t count = 0;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const Vec3& x = surface.vertices[v];
    if (!mapped.result.referenced[v] || x.y() > y || std::abs(x.x() - 0.45) > 0.1) continue;
    const double u = mapped.result.displacement[v].x();
    count += std::abs(u) > 0.1 * kOpening && u < 0.7 * kOpening;
  }
  return count;
}

TEST(Notch, IsOpenedUpToItsEnd) {
  for (const int n : {1, 7}) {
    Body body = notched_bar(n);
    const MappedPart mapped = map_broken(body, CrackMode::cap);
    ASSERT_TRUE(mapped.cracked);
    expect_whole(body, mapped);
    const Surface& surface = mapped.cracked->surface;
    ASSERT_EQ(surface.parts.size(), 1u);
    EXPECT_EQ(surface.parts[0].name, "part");
    EXPECT_EQ(mapped.report.crack.fragments, 0u);
    EXPECT_EQ(mapped.report.crack.cracked_parts, 1u);
    EXPECT_EQ(euler(pieces_of(surface)[0]), 2);
    EXPECT_EQ(torn_between(mapped, 0.04), 0u);
    // Walls up to y = 0.15, half a cell before the whole ones, twice.
    double area = 0, farthest = 0;
    for (const auto& t : triangulate(surface).corners) {
      const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
      if ((Vec3(a.x(), b.x(), c.x()) - Vec3::Constant(0.45)).cwiseAbs().maxCoeff() > 1e-4) continue;
      area += 0.5 * (b - a).cross(c - a).norm();
      farthest = std::max({farthest, a.y(), b.y(), c.y()});
    }
    EXPECT_NEAR(farthest, 0.15, 1e-4);
    EXPECT_NEAR(area, 2 * 0.15 * 0.3, 0.03 * area);  // the surface lies a little inside the lattice's outside
    // The mouth is as wide as its elements are apart; what opens is no matter.
    double mouth = 0;
    for (std::size_t v = 0; v < surface.vertices.size(); ++v)
      if (std::abs(surface.vertices[v].x() - 0.45) < 1e-4 && surface.vertices[v].y() < 0.01)
        mouth = std::max(mouth, mapped.result.displacement[v].x());
    EXPECT_NEAR(mouth, kOpening, 0.1 * kOpening);
  }
}

TEST(Notch, StaysStretchedWhereItIsKeptAndIsTold) {
  Body body = notched_bar(7);
  const MappedPart mapped = map_broken(body, CrackMode::keep);
  EXPECT_FALSE(mapped.cracked);
  EXPECT_EQ(mapped.report.crack.cracked_parts, 1u);
  EXPECT_GT(mapped.report.crack.spanning_triangles, 0u);
}

TEST(Notch, OpenLeavesTheWallsOut) {
  for (const int n : {1, 7}) {
    Body body = notched_bar(n);
    const MappedPart mapped = map_broken(body, CrackMode::open);
    ASSERT_TRUE(mapped.cracked);
    const Surface& surface = mapped.cracked->surface;
    check(surface, "notched");
    const Piece piece = pieces_of(surface)[0];
    EXPECT_EQ(euler(piece), 1);  // a disc
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sum;
    for (const auto& corner : piece.polygons)
      for (std::size_t k = 0; k < corner.size(); ++k) {
        const std::uint32_t a = corner[k], b = corner[(k + 1) % corner.size()];
        sum[std::minmax(a, b)] += a < b ? 1 : -1;
      }
    for (const auto& [edge, count] : sum)
      if (count != 0) {
        EXPECT_NEAR(surface.vertices[edge.first].x(), 0.45, 2e-5);
        EXPECT_LT(surface.vertices[edge.first].y(), 0.1501);
      }
    EXPECT_EQ(torn_between(mapped, 0.04), 0u);
  }
}

// A crack inside the matter, that the surface shows nothing of: a hollow, once it opens.
TEST(Notch, ACrackInTheMiddleBecomesAHollow) {
  Body body = block(8, 8, 6, 0.1, Placement::corner, 3);
  break_cells(body, [](const Vec3& x) {
    return std::abs(x.z() - 0.25) < 0.05 && std::abs(x.x() - 0.4) < 0.25 && std::abs(x.y() - 0.4) < 0.25;
  });
  deform(body, [](const Vec3& x) -> Vec3 {
    const double open = std::max(0.0, 0.04 - (x - Vec3(0.4, 0.4, x.z())).squaredNorm());
    return x + Vec3(0, 0, x.z() > 0.25 && x.z() < 0.35 ? 0.5 * open : 0);
  });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  ASSERT_TRUE(mapped.cracked);
  expect_whole(body, mapped);
  EXPECT_EQ(euler(pieces_of(mapped.cracked->surface)[0]), 4);
  EXPECT_LT(mapped.report.quality.volume_after, volume_of(body.surface) - 1e-4);
}

// Cracks that cross, end on one another and turn corners.
TEST(Notch, CracksThatMeetStayOneClosedSurface) {
  Body body = block(6, 6, 4, 0.1, Placement::corner, 4);
  break_cells(body, [](const Vec3& x) {
    const bool along = x.y() > 0.2 && x.y() < 0.3 && x.x() < 0.5 && x.z() < 0.3;
    const bool across = x.x() > 0.2 && x.x() < 0.3 && x.y() < 0.4 && x.z() < 0.3;
    const bool level = x.z() > 0.1 && x.z() < 0.2 && x.x() > 0.3 && x.y() < 0.4;
    return along || across || level;
  });
  deform(body, [](const Vec3& x) -> Vec3 { return x; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  ASSERT_TRUE(mapped.cracked);
  expect_whole(body, mapped);
}

class Cracks : public testing::TestWithParam<int> {};

// Few broken cells: cracks that end inside nearly everywhere.
TEST_P(Cracks, AreClosedAndAddUpWhateverBroke) {
  std::mt19937 random(static_cast<unsigned>(GetParam()));
  std::uniform_real_distribution<double> uniform(0, 1);
  const double share = 0.2 + 0.05 * GetParam();
  Body body = GetParam() % 2 ? block(5, 5, 4, 0.1, Placement::corner, 1 + GetParam())
                             : ball(Placement::corner, rotation(0.3 * GetParam(), Vec3(1, 2, 3)), 0.2);
  break_cells(body, [&](const Vec3&) { return uniform(random) < share; });
  deform(body, [](const Vec3& x) -> Vec3 { return x; });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  if (mapped.cracked) expect_whole(body, mapped);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Cracks, testing::Range(0, 8));

// A pocket carved into the far end of a bar that broke in two, and has a notch.
TEST(Notch, CarvedAndCrackedIsPartedAndClosed) {
  Lattice lattice;
  lattice.spacing = Vec3::Constant(0.1);
  const auto gone = [](const Vec3& x) { return x.x() > 0.7 && x.y() > 0.2 && x.z() > 0.1; };
  Body body = make_body(
      lattice, {0, 0, 0}, {9, 4, 3}, [&](const Vec3& x) { return !gone(x); }, Placement::corner);
  add_box_surface(body, Vec3::Zero(), Vec3(0.9, 0.4, 0.3), 4);
  derive_surface_cells(body);
  int count = 0;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 3; ++k)
        if (gone(0.1 * Vec3(i + 0.5, j + 0.5, k + 0.5))) {
          body.notes[kCarvedNote] +=
              "0 " + std::to_string(i) + " " + std::to_string(j) + " " + std::to_string(k) + "\n";
          ++count;
        }
  break_cells(body, [](const Vec3& x) {
    return (x.x() > 0.4 && x.x() < 0.5) || (x.x() > 0.2 && x.x() < 0.3 && x.y() < 0.2);
  });
  deform(body, [](const Vec3& x) -> Vec3 { return x + Vec3(x.x() > 0.45 ? 0.3 : 0, 0, 0); });
  const MappedPart mapped = map_broken(body, CrackMode::cap);
  ASSERT_TRUE(mapped.cracked);
  const Surface& surface = mapped.cracked->surface;
  check(surface, "carved and cracked");
  ASSERT_EQ(surface.parts.size(), 2u);
  EXPECT_EQ(mapped.report.crack.fragments, 2u);
  EXPECT_EQ(mapped.report.crack.cracked_parts, 1u);
  std::vector<Vec3> moved = surface.vertices;
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += mapped.result.displacement[v];
  double sum = 0;
  for (const Piece& piece : pieces_of(surface)) {
    EXPECT_EQ(euler(piece), 2);
    EXPECT_EQ(what_cgal_minds(moved, piece.triangles), "");
    sum += signed_volume(surface.vertices, piece.triangles);
  }
  const double went = 1e-3 * count;
  EXPECT_NEAR(volume_of(body.surface) - sum, went, 1e-3 * went);
  for (std::size_t v = 0; v < moved.size(); ++v)
    if (mapped.result.referenced[v] && std::abs(surface.vertices[v].x() - 0.45) > 1e-3) {
      EXPECT_LT(std::abs(mapped.result.displacement[v].x() - (surface.vertices[v].x() > 0.45 ? 0.3 : 0)),
                1e-3);
    }
}

}  // namespace
}  // namespace flexel::mapping
