#include "formats/part/surface.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/math/area_vector.h"

namespace flexel {
namespace {

Surface one_polygon(const std::vector<Vec3>& outline) {
  Surface surface;
  surface.vertices = outline;
  surface.polygon_offsets = {0, static_cast<std::uint32_t>(outline.size())};
  for (std::uint32_t i = 0; i < outline.size(); ++i) surface.polygon_vertices.push_back(i);
  surface.polygon_face = {0};
  surface.faces = {{"", 0}};
  surface.parts = {{"a"}};
  surface.sources.resize(1);
  surface.part_source = {0};
  return surface;
}

// All triangles of a plane simple polygon turn the same way and add up to its area: that leaves no overlap
// and no gap.
void expect_exact_cover(const std::vector<Vec3>& outline, double area) {
  const Surface surface = one_polygon(outline);
  const Triangles triangles = triangulate(surface);
  ASSERT_EQ(triangles.corners.size(), outline.size() - 2);
  Vec3 sum = Vec3::Zero();
  double absolute = 0;
  for (const auto& t : triangles.corners) {
    sum += area_vector(surface.vertices, t);
    absolute += area_vector(surface.vertices, t).norm();
  }
  EXPECT_NEAR(sum.norm(), area, 1e-12 * area);
  EXPECT_NEAR(absolute, area, 1e-12 * area);
}

std::vector<Vec3> turned(std::vector<Vec3> outline, double angle) {
  const Mat3 rotation = Eigen::AngleAxisd(angle, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (Vec3& v : outline) v = rotation * v;
  return outline;
}

TEST(Triangulate, CoversConvexAndConcavePolygonsExactlyInAnyPose) {
  std::vector<Vec3> comb{{0, 0, 0}};
  for (int i = 0; i < 6; ++i) {
    comb.push_back(Vec3(2 * i, 5, 0));
    comb.push_back(Vec3(2 * i + 1, 5, 0));
    comb.push_back(Vec3(2 * i + 1, 1, 0));
    comb.push_back(Vec3(2 * i + 2, 1, 0));
  }
  comb.push_back(Vec3(12, 0, 0));
  std::vector<Vec3> star;
  for (int i = 0; i < 24; ++i) {
    const double r = i % 2 ? 1 : 3, a = 2 * std::numbers::pi * i / 24;
    star.emplace_back(r * std::cos(a), r * std::sin(a), 0);
  }
  const double star_area = 12 * 1 * 3 * std::sin(2 * std::numbers::pi / 24);
  for (const double angle : {0.0, 0.7, 2.0, 3.1}) {
    expect_exact_cover(turned({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, angle), 2);
    expect_exact_cover(turned({{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}}, angle), 4);  // a dart
    expect_exact_cover(turned(star, angle), star_area);
    expect_exact_cover(turned(comb, angle), 12 + 6 * 4);
  }
}

TEST(Triangulate, ACornerOnAStraightEdgeGivesNoTriangleWithoutArea) {
  const Surface surface = one_polygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}});
  for (const auto& t : triangulate(surface).corners) EXPECT_GT(area_vector(surface.vertices, t).z(), 0.1);
}

TEST(Triangulate, PolygonsWithoutAreaOrCrossingThemselvesStillGiveTheirTriangles) {
  EXPECT_EQ(triangulate(one_polygon({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}})).corners.size(),
            3u);
  EXPECT_EQ(triangulate(one_polygon({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}})).corners.size(), 2u);
}

std::string check_error(const Surface& surface) {
  try {
    check(surface, "file");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CheckSurface, NamesTheFirstFault) {
  const Surface good = one_polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  EXPECT_EQ(check_error(good), "");
  Surface bad = good;
  bad.vertices[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(check_error(bad), "vertex 2 is not finite");
  bad = good;
  bad.vertices[2].z() = 1e13;
  EXPECT_NE(check_error(bad).find("vertex 3"), std::string::npos);
  bad = good;
  bad.polygon_vertices[0] = 3;
  EXPECT_EQ(check_error(bad), "polygon 1 names vertex 4, but there are only 3");
  bad = good;
  bad.polygon_offsets = {0, 2};
  EXPECT_NE(check_error(bad), "");
  bad = good;
  bad.polygon_face[0] = 1;
  EXPECT_EQ(check_error(bad), "polygon 1 names a face that does not exist");
  bad = good;
  bad.faces[0].part = 1;
  EXPECT_NE(check_error(bad), "");
  bad = good;
  bad.part_source = {4};
  EXPECT_NE(check_error(bad), "");
  EXPECT_EQ(check_error(Surface{}), "holds no polygons: nothing to work on");
}

TEST(CheckSurface, AVertexInTwoPartsIsRefused) {
  Surface surface = one_polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  surface.polygon_offsets.push_back(6);
  surface.polygon_vertices = {0, 1, 2, 2, 1, 0};
  surface.polygon_face = {0, 1};
  surface.parts.push_back({"b"});
  surface.part_source.push_back(0);
  surface.faces.push_back({"", 0});
  EXPECT_EQ(check_error(surface), "");
  surface.faces[1].part = 1;
  EXPECT_EQ(check_error(surface), "vertex 3 belongs to two parts");
}

TEST(Append, KeepsBothAndMakesNamesUnique) {
  const Surface one = one_polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  Surface both = one;
  append(both, one_polygon({{5, 0, 0}, {6, 0, 0}, {6, 1, 0}, {5, 1, 0}}));
  append(both, one);
  check(both, "appended");
  EXPECT_EQ(both.polygon_offsets, (std::vector<std::uint32_t>{0, 3, 7, 10}));
  EXPECT_EQ(both.parts[1].name, "a-2");
  EXPECT_EQ(both.parts[2].name, "a-3");
  EXPECT_EQ(both.polygon_part(1), 1u);
  EXPECT_EQ(both.part_source, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(both.vertices[both.polygon(1)[2]], Vec3(6, 1, 0));
  Surface empty;
  append(empty, one);
  check(empty, "appended to nothing");
}

TEST(Append, FillsAttributesThatOneFileLacks) {
  Surface one = one_polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), other = one, third = one;
  one.vertex_columns["color"] = {3, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  one.vertex_columns["quality"] = {1, {7, 8, 9}};
  third.vertex_columns["color"] = {4, {0, 0, 0, 0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5}};
  third.polygon_columns["color"] = {3, {0.25, 0.5, 0.75}};
  append(one, other);
  append(one, third);
  check(one, "appended");
  EXPECT_EQ(one.vertex_columns["color"].components, 4);
  EXPECT_EQ(one.vertex_columns["color"].values,
            (std::vector<double>{1, 0, 0, 1, 0, 1, 0, 1, 0, 0,   1, 1, 1, 1,   1, 1, 1, 1,
                                 1, 1, 1, 1, 1, 1, 0, 0, 0, 0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5}));
  EXPECT_EQ(one.vertex_columns["quality"].values, (std::vector<double>{7, 8, 9, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(one.polygon_columns["color"].values, (std::vector<double>{1, 1, 1, 1, 1, 1, 0.25, 0.5, 0.75}));
}

TEST(CheckSurface, AttributesAreCheckedByName) {
  const Surface good = one_polygon({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  const auto error = [&](const std::string& name, const Column& column) {
    Surface bad = good;
    bad.vertex_columns[name] = column;
    return check_error(bad);
  };
  const std::string damaged = "the surface is damaged: vertex_columns ";
  EXPECT_EQ(error("quality", {1, {1, 2, 3}}), "");
  EXPECT_EQ(error("quality", {1, {1, 2}}), damaged + "\"quality\" has 2 values in place of 3");
  EXPECT_EQ(error("quality", {0, {}}), damaged + "\"quality\" has no components");
  EXPECT_EQ(error("quality", {1, {1, 2, std::nan("")}}),
            damaged + "\"quality\" has a value that is not finite");
  EXPECT_EQ(error("a b", {1, {1, 2, 3}}), damaged + "\"a b\" is not the name of a column");
  EXPECT_EQ(error("color", {1, {1, 0, 1}}), damaged + "\"color\" has neither 3 nor 4 components");
  EXPECT_EQ(error("color", {3, std::vector<double>(9, 1.5)}),
            damaged + "\"color\" has a value outside [0, 1]");
  Surface bad = good;
  bad.polygon_columns["color"] = {3, {0, 0}};
  EXPECT_NE(check_error(bad).find("polygon_columns \"color\""), std::string::npos);
}

TEST(ColumnName, AnyTextBecomesAName) {
  EXPECT_EQ(column_name("quality 2\xC3\xA9"), "quality_2__");
  EXPECT_EQ(column_name(""), "_");
}

TEST(PartNames, ARepeatedNameDoesNotTakeOneThatIsInUse) {
  Surface surface;
  surface.parts = {{"a"}, {"a"}, {"a-2"}, {""}, {"a"}, {""}};
  make_part_names_unique(surface, "p");
  std::vector<std::string> names;
  for (const auto& part : surface.parts) names.push_back(part.name);
  EXPECT_EQ(names, (std::vector<std::string>{"a", "a-3", "a-2", "p", "a-4", "p-2"}));
}

TEST(FaceNumbers, CountWithinThePart) {
  Surface surface;
  surface.faces = {{"", 0}, {"", 1}, {"", 0}, {"", 1}, {"", 1}};
  surface.parts.resize(2);
  EXPECT_EQ(face_numbers(surface), (std::vector<std::uint32_t>{1, 1, 2, 2, 3}));
}

}  // namespace
}  // namespace flexel
