// What flat triangles miss of a deformation, against what is known of a circle; and with finer ones.
#include "mapping/report/chord.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/part/subdivide.h"
#include "mapping/report/report.h"
#include "motions.h"

namespace flexel::mapping {
namespace {

using test::map_quietly;

using test::coarse_bar, test::kBarLength;

constexpr double kArc = 0.5;  // over the length of the bar

Vec3 bent(const Vec3& p) {
  return test::along_circle(p, kArc, 0);
}

class Chord : public testing::TestWithParam<MapMethod> {};

TEST_P(Chord, IsTheSagittaOfABentBar) {
  Body body = coarse_bar();
  test::deform(body, bent);
  const MapReport found = report(body, map_quietly(body, GetParam()));
  // The lowest edges are the longest arcs, of the largest radius.
  const Box box = bounding_box(body.surface.vertices);
  const double radius = kBarLength / kArc - box.min.z(), angle = box.size().x() / (kBarLength / kArc);
  const double sagitta = radius * (1 - std::cos(angle / 2));
  ASSERT_TRUE(found.chord);
  EXPECT_NEAR(found.chord->largest, sagitta, 0.02 * sagitta);
  EXPECT_NEAR(found.chord->at.x(), kBarLength / 2, 0.06 * kBarLength);
  EXPECT_NEAR(found.chord->share(), sagitta / found.largest_displacement, 0.02);
  EXPECT_NEAR(found.chord->longest_edge, std::hypot(box.size().x(), box.size().z()), 1e-9);
  EXPECT_EQ(found.chord->coarse_triangles, 4u);  // above and below; the sides stay in their planes
  EXPECT_TRUE(found.placed());
  EXPECT_FALSE(found.valid());
  const std::string verdict = report_lines(found).front();
  EXPECT_NE(verdict.find("cannot be used as it is: its triangles, up to 4.0"), std::string::npos) << verdict;
  EXPECT_NE(verdict.find("--refine "), std::string::npos) << verdict;
  const auto json = nlohmann::json::parse(report_json(found, {GetParam()}));
  EXPECT_FALSE(json["valid"]);
  EXPECT_EQ(json["failures"]["coarse_triangles"], found.chord->coarse_triangles);
  EXPECT_EQ(json["chord_error"]["largest"], found.chord->largest);
}

TEST_P(Chord, IsGoneWithTheEdgesThatAreAdvised) {
  Body body = coarse_bar();
  test::deform(body, bent);
  const ChordError coarse = *report(body, map_quietly(body, GetParam())).chord;
  const double edge = sufficient_edge(coarse);
  EXPECT_GT(edge, 3 * test::kBarSpacing);  // or nothing would be looked at
  subdivide_mesh(body.surface, edge, "bar");
  const MapReport found = report(body, map_quietly(body, GetParam()));
  EXPECT_LT(found.chord->share(), 0.005);
  EXPECT_GT(found.chord->largest, 0);
  EXPECT_EQ(found.chord->coarse_triangles, 0u);
  EXPECT_TRUE(found.valid());
  EXPECT_NE(report_lines(found).front().find("can be used"), std::string::npos);
}

TEST_P(Chord, IsNoneOfAMotionThatKeepsPlanesFlat) {
  const Mat3 turned = test::rotation(2.1, Vec3(1, 2, 3));
  const Mat3 sheared = (Mat3() << 1.2, 0.3, 0, -0.1, 0.9, 0.2, 0.1, 0, 1.1).finished();
  for (const Mat3& motion : {turned, sheared, Mat3(Mat3::Identity())}) {
    Body body = coarse_bar();
    test::deform(body, [&](const Vec3& p) -> Vec3 { return motion * p + Vec3(0.1, 7, 0); });
    const MapReport found = report(body, map_quietly(body, GetParam()));
    EXPECT_LT(found.chord->largest, 1e-13);
    EXPECT_EQ(found.chord->coarse_triangles, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Chord, testing::ValuesIn(test::kEveryMethod),
                         [](const auto& with) { return test::test_name(with.param); });

// The rim of the plate stays where it is: only points inside its triangles move.
TEST(ChordOfAPlate, SeesWhatNoVertexDoes) {
  Body body = test::block(24, 24, 2, 0.1, Placement::corner, 1);
  body.surface_cell_offsets.clear();
  body.surface_cells.clear();
  test::deform(body, [](const Vec3& p) -> Vec3 {
    const double x = p.x() / 2.4, y = p.y() / 2.4;
    return p + Vec3(0, 0, 0.3 * 16 * x * (1 - x) * y * (1 - y));
  });
  const MapReport found = report(body, map_quietly(body, &kBlended));
  EXPECT_LT(found.largest_displacement, 0.02);
  EXPECT_NEAR(found.chord->largest, 0.3, 0.02);
  EXPECT_NEAR(found.chord->share(), 1, 0.05);
  EXPECT_FALSE(found.valid());
}

// Twelve triangles around a bar that fell apart: what lies between the halves is not bent.
TEST(ChordOfABrokenBar, LeavesOutWhatTheFractureTore) {
  Body body = coarse_bar();
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    body.broken[c] = body.lattice_index[body.cell_elements[c][0]][0] == 40;
  test::deform(body, [](const Vec3& p) -> Vec3 {
    return p.x() < kBarLength / 2 + test::kBarSpacing / 2 ? p : Vec3(p + Vec3(1, 0, 0.5));
  });
  const MapReport found = report(body, map_quietly(body, &kBlended));
  EXPECT_EQ(found.chord->coarse_triangles, 0u);
  EXPECT_LT(found.chord->largest, 1e-12);
}

TEST(ChordOfACutSurface, IsNotMeasured) {
  Body body = coarse_bar();
  test::deform(body, bent);
  const MapReport found = report(body, map_quietly(body, &kBlended), true);
  EXPECT_FALSE(found.chord);
  EXPECT_TRUE(nlohmann::json::parse(report_json(found, {}))["chord_error"].is_null());
}

}  // namespace
}  // namespace flexel::mapping
