// The flags and the report: what the deformation did to the frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bodies.h"
#include "mapping/methods/bind.h"
#include "mapping/report/report.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

using test::map_quietly;

class Flags : public testing::TestWithParam<MapMethod> {};

TEST_P(Flags, ACellTurnedInsideOutIsInverted) {
  Body body = test::block(5, 5, 5, 0.1, Placement::corner, 15);
  // The corner element is pushed through its cell.
  std::uint32_t corner = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e] == Index3{5, 5, 5}) corner = e;
  body.position[corner] -= Vec3::Constant(0.35);
  const MapResult result = map_quietly(body, GetParam());
  std::size_t around = 0;
  for (std::size_t v = 0; v < result.flags.size(); ++v) {
    const auto& held_by = result.frame_of(v).elements;
    const bool held = std::find(held_by.begin(), held_by.end(), corner) != held_by.end();
    around += held;
    EXPECT_EQ((result.flags[v] & kFrameInverted) != 0, held);
  }
  EXPECT_GT(around, 3u);
  const MapReport found = report(body, result);
  EXPECT_EQ(found.inverted, around);
  EXPECT_FALSE(found.valid());
  EXPECT_NE(report_lines(found).front().find("cannot be used"), std::string::npos);
}

TEST_P(Flags, AReflectionTurnsEveryFrameInsideOut) {
  Body body = test::block(3, 3, 3, 0.1, Placement::centre);
  test::deform(body, [](const Vec3& x) -> Vec3 { return {-x.x(), x.y(), x.z()}; });
  const MapReport found = report(body, map_quietly(body, GetParam()));
  EXPECT_EQ(found.inverted, found.vertices);
}

TEST_P(Flags, ABodyPressedFlatIsDegenerateAndStaysFinite) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::block(4, 4, 4, 0.1, placement);
    test::deform(body, [](const Vec3& x) -> Vec3 { return {x.x(), x.y(), 0}; });
    const MapResult result = map_quietly(body, GetParam());
    const MapReport found = report(body, result);
    EXPECT_EQ(found.degenerate, found.vertices);
    EXPECT_EQ(found.not_finite, 0u);
    test::deform(body, [](const Vec3&) -> Vec3 { return Vec3::Zero(); });
    EXPECT_EQ(report(body, map_quietly(body, GetParam())).degenerate, found.vertices);
  }
}

TEST_P(Flags, WhatIsNotFiniteIsSaid) {
  Body body = test::block(3, 3, 3, 0.1, Placement::centre);
  test::deform(body, [](const Vec3& x) -> Vec3 { return (x - Vec3::Constant(0.1)) * 1e308 * 1e3; });
  const MapReport found = report(body, map_quietly(body, GetParam()));
  EXPECT_EQ(found.not_finite, found.vertices);
  EXPECT_FALSE(found.valid());
  EXPECT_TRUE(nlohmann::json::parse(report_json(found, {GetParam()}))["volume_after"].is_null());
}

INSTANTIATE_TEST_SUITE_P(Methods, Flags, testing::ValuesIn(test::kEveryMethod),
                         [](const auto& with) { return test::test_name(with.param); });

TEST(Voronoi, RigidAndUniformMotionLeaveNoCellAndShearDoes) {
  Body body = test::block(6, 6, 6, 0.1, Placement::centre, 12);
  const auto left = [&](const test::Field& field) {
    test::deform(body, field);
    return report(body, map_quietly(body, &kAffine)).voronoi_cell_left;
  };
  const Mat3 turn = test::rotation(1.2, Vec3(1, 2, -1));
  EXPECT_EQ(left([&](const Vec3& x) -> Vec3 { return turn * x; }), 0u);
  EXPECT_EQ(left([&](const Vec3& x) -> Vec3 { return 3 * x; }), 0u);
  EXPECT_GT(left([&](const Vec3& x) -> Vec3 { return {x.x() + 2 * x.y(), x.y(), x.z()}; }), 20u);
}

// The neighbours of the origin decide as a look at every element does, in a body that is sheared but not
// folded: a vertex left where another element is nearer now, and the origin was at rest, both by a hundredth
// of their distance.
TEST(Voronoi, AgreesWithALookAtEveryElement) {
  Body body = test::block(6, 6, 6, 0.1, Placement::centre, 10);
  test::deform(body, [](const Vec3& x) -> Vec3 {
    return {x.x() + 0.6 * x.y() - 0.3 * x.z(), x.y() * 0.9, x.z() + 0.1 * x.x()};
  });
  const MapResult result = map_quietly(body, &kAffine);
  std::size_t flagged = 0;
  for (std::size_t v = 0; v < result.flags.size(); ++v) {
    const Vec3& rest = body.surface.vertices[v];
    const Vec3 now = rest + result.displacement[v];
    const std::uint32_t origin = result.frame_of(v).elements[0];
    bool left = false;
    for (std::uint32_t e = 0; e < body.element_count(); ++e) {
      const Vec3 way = body.rest[e] - body.rest[origin];
      const double before = way.normalized().dot(rest - (body.rest[e] + body.rest[origin]) / 2);
      const double nearer =
          (now - body.position[origin]).squaredNorm() - (now - body.position[e]).squaredNorm();
      left = left || (e != origin && before < -0.01 * way.norm() && nearer > 0.02 * way.squaredNorm());
    }
    EXPECT_EQ((result.flags[v] & kVoronoiCellLeft) != 0, left);
    flagged += left;
  }
  EXPECT_GT(flagged, 0u);
}

// Vertices half-way between elements are on one side or the other after the least motion.
TEST(Voronoi, TiesAtRestAndSmallStrainsLeaveNoCell) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::block(6, 6, 6, 0.1, placement, 12);
    for (Vec3& vertex : body.surface.vertices)
      vertex = (vertex / 0.05).array().round().matrix() * 0.05;  // corners and middles of the voxels
    const auto sheared = [&](double by) {
      test::deform(body, [&](const Vec3& x) -> Vec3 {
        return {x.x() + by * x.y(), x.y() - by * x.z(), x.z()};
      });
      return report(body, map_quietly(body, &kAffine));
    };
    for (const double by : {4e-4, 4e-3}) EXPECT_EQ(sheared(by).voronoi_cell_left, 0u) << by;
    const auto said = [](const MapReport& found) {
      for (const std::string& line : report_lines(found))
        if (line.find("Voronoi cell left") != std::string::npos) return true;
      return false;
    };
    for (Vec3& vertex : body.surface.vertices) vertex += Vec3(0.013, 0.017, 0.011);
    EXPECT_FALSE(said(sheared(0.05)));  // whatever was counted
    const MapReport strong = sheared(1.5);
    EXPECT_GT(strong.voronoi_cell_left, 0u);
    EXPECT_TRUE(said(strong));
  }
}

TEST(Report, HoldsVolumeAndDisplacement) {
  Body body = test::block(4, 4, 4, 0.1, Placement::corner);
  test::deform(body, [](const Vec3& x) -> Vec3 { return {2 * x.x(), 3 * x.y(), x.z()}; });
  const MapReport found = report(body, map_quietly(body, &kAffine));
  const double side = 0.4 - 0.003;
  EXPECT_NEAR(found.quality.volume_before, side * side * side, 1e-12);
  EXPECT_NEAR(found.quality.volume_after, 6 * side * side * side, 1e-12);
  EXPECT_NEAR(found.largest_displacement, std::hypot(0.3983, 2 * 0.3983), 1e-12);
  const auto json = nlohmann::json::parse(report_json(found, {&kAffine}));
  EXPECT_EQ(json["method"], "affine");
  EXPECT_TRUE(json["valid"]);
  EXPECT_EQ(json["frames"]["full"], found.vertices);
  EXPECT_EQ(json["failures"]["inverted"], 0);
  EXPECT_DOUBLE_EQ(json["volume_after"], found.quality.volume_after);
}

}  // namespace
}  // namespace flexel::mapping
