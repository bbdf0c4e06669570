#include "formats/part/subdivide.h"

#include <gmock/gmock.h>

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/math/area_vector.h"
#include "formats/exchange/surface_file.h"
#include "tests/formats/import_help.h"
#include "tests/sanitized.h"

namespace flexel::test {
namespace {

double longest_edge(const Surface& surface) {
  double longest = 0;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (std::size_t i = 0; i < 3; ++i)
      longest = std::max(longest, (surface.vertices[surface.polygon(p)[i]] -
                                   surface.vertices[surface.polygon(p)[(i + 1) % 3]])
                                      .norm());
  return longest;
}

struct FaceSum {
  double area = 0;
  Vec3 vector = Vec3::Zero();
};

std::vector<FaceSum> face_sums(const Surface& surface) {
  std::vector<FaceSum> sums(surface.faces.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    sums[surface.polygon_face[p]].area += area_vector(surface.vertices, surface.polygon(p)).norm();
    sums[surface.polygon_face[p]].vector += area_vector(surface.vertices, surface.polygon(p));
  }
  return sums;
}

double smallest_angle(const Surface& surface) {
  double smallest = 4;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto at = [&](std::size_t k) { return surface.vertices[surface.polygon(p)[(i + k) % 3]]; };
      const Vec3 a = at(1) - at(0), b = at(2) - at(0);
      smallest = std::min(smallest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return smallest;
}

void expect_same_solid(const Surface& coarse, const Surface& fine) {
  const Shape before = shape(coarse), after = shape(fine);
  EXPECT_TRUE(after.topology.closed() && after.topology.oriented());
  EXPECT_EQ(after.topology.shell_count, before.topology.shell_count);
  EXPECT_NEAR(after.volume / before.volume, 1, 1e-12);
  EXPECT_TRUE(std::is_sorted(fine.polygon_face.begin(), fine.polygon_face.end()));
  ASSERT_EQ(fine.faces.size(), coarse.faces.size());
  const std::vector<FaceSum> expected = face_sums(coarse), found = face_sums(fine);
  for (std::size_t f = 0; f < expected.size(); ++f) {
    EXPECT_NEAR(found[f].area, expected[f].area, 1e-12 * expected[f].area) << f;
    EXPECT_NEAR((found[f].vector - expected[f].vector).norm(), 0, 1e-12 * expected[f].area) << f;
  }
}

// A box of 40 x 30 x 2 mm with a face per side.
Surface plate() {
  const Scratch scratch;
  return import_surface(scratch.write("plate.stl", binary_stl(box_facets({0, 0, 0}, {40, 30, 2}))));
}

TEST(Subdivide, KeepsTheSolidAndItsFacesAndBoundsTheEdges) {
  const Surface coarse = plate();
  for (const double limit : {0.06, 0.03, 7e-3, 1e-3}) {
    Surface fine = coarse;
    ASSERT_TRUE(subdivide(fine, 0, limit, 1'000'000));
    EXPECT_LE(longest_edge(fine), limit);
    EXPECT_GE(smallest_angle(fine), smallest_angle(coarse) / 2 * (1 - 1e-9));
    EXPECT_TRUE(std::equal(coarse.vertices.begin(), coarse.vertices.end(), fine.vertices.begin()));
    expect_same_solid(coarse, fine);
  }
}

TEST(Subdivide, LeavesAloneWhatIsFineAlready) {
  const Surface coarse = plate();
  Surface fine = coarse;
  ASSERT_TRUE(subdivide(fine, 0, 0.06, 1'000'000));
  EXPECT_EQ(fine.vertices, coarse.vertices);
  EXPECT_EQ(fine.polygon_vertices, coarse.polygon_vertices);
  EXPECT_EQ(fine.polygon_offsets, coarse.polygon_offsets);
}

TEST(Subdivide, StopsAtTheMostTrianglesWithAClosedMesh) {
  const Surface coarse = plate();
  Surface fine = coarse;
  EXPECT_FALSE(subdivide(fine, 0, 1e-6, 5000));
  EXPECT_GE(fine.polygon_count(), 5000u);
  EXPECT_LE(fine.polygon_count(), 5001u);
  expect_same_solid(coarse, fine);
}

// A rod along x, each of its flat sides two needles.
Surface rod(int sides) {
  std::string text = "o rod\n";
  for (int end = 0; end < 2; ++end)
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      text += fmt::format("v {} {:.17g} {:.17g}\n", 200 * end, 5 * std::cos(angle), 5 * std::sin(angle));
    }
  for (int i = 0; i < sides; ++i) {
    const int a = i + 1, b = (i + 1) % sides + 1, c = b + sides, d = a + sides;
    text += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, c, a, c, d);
  }
  for (int i = 1; i < sides - 1; ++i) text += fmt::format("f 1 {} {}\n", i + 2, i + 1);
  for (int i = 1; i < sides - 1; ++i)
    text += fmt::format("f {} {} {}\n", 1 + sides, i + 1 + sides, i + 2 + sides);
  const Scratch scratch;
  ImportOptions options;
  options.unit = 1e-3;
  return import_surface(scratch.write("rod.obj", text), options);
}

TEST(Subdivide, NeedlesBecomeStrips) {
  const Surface coarse = rod(40);
  Surface fine = coarse;
  ASSERT_TRUE(subdivide(fine, 0, 3.3e-3, 1'000'000));
  EXPECT_LE(longest_edge(fine), 3.3e-3);
  expect_same_solid(coarse, fine);
  // 64 pieces of each side, two triangles each, and the ends.
  EXPECT_LT(fine.polygon_count(), 40 * 128u + 300);
  // What lies at vertices and polygons is between them as before: nothing is flipped.
  Surface coloured = coarse;
  coloured.vertex_columns["heat"] = {1, std::vector<double>(coarse.vertices.size(), 1.0)};
  ASSERT_TRUE(subdivide(coloured, 0, 3.3e-3, 1'000'000));
  expect_same_solid(coarse, coloured);
  EXPECT_GT(coloured.polygon_count(), fine.polygon_count());
}

TEST(Subdivide, PolygonsBeforeTheFirstStayAsTheyAre) {
  Surface two = plate();
  Surface other = plate();
  for (Vec3& vertex : other.vertices) vertex.z() += 0.01;  // apart, or welding would make them one
  append(two, std::move(other));
  const Surface before = two;
  ASSERT_TRUE(subdivide(two, 12, 5e-3, 1'000'000));
  EXPECT_TRUE(std::equal(before.polygon_vertices.begin(), before.polygon_vertices.begin() + 36,
                         two.polygon_vertices.begin()));
  EXPECT_GT(two.polygon_count(), 100u);
  expect_same_solid(before, two);
}

// A box of six quads, of 40 x 30 x 2 mm, with a group a side.
std::string box_of_quads() {
  std::string text = "o box\n";
  for (int v = 0; v < 8; ++v)
    text += fmt::format("v {} {} {}\n", v & 1 ? 40 : 0, v & 2 ? 30 : 0, v & 4 ? 2 : 0);
  int side = 0;
  for (const char* quad : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"})
    text += fmt::format("g side{}\nf {}\n", ++side, quad);
  return text;
}

TEST(SubdivideImport, MeshesAreSplitWhereTheUserAsks) {
  const Scratch scratch;
  ImportOptions options;
  options.largest_edge = 4e-3;
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>{"plate.stl", binary_stl(box_facets({0, 0, 0}, {40, 30, 2}))},
        {"plate.obj", box_of_quads()}}) {
    SCOPED_TRACE(name);
    const std::string path = scratch.write(name, bytes);
    const Surface coarse = import_surface(path), fine = import_surface(path, options);
    EXPECT_LE(coarse.polygon_count(), 12u);
    EXPECT_TRUE(refinement_notes(coarse).empty());
    EXPECT_LE(longest_edge(fine), 4e-3);
    EXPECT_TRUE(std::equal(coarse.vertices.begin(), coarse.vertices.end(), fine.vertices.begin()));
    expect_same_solid(coarse, fine);
    EXPECT_EQ(fine.parts[0].name, coarse.parts[0].name);
    for (std::size_t f = 0; f < coarse.faces.size(); ++f) EXPECT_EQ(fine.faces[f].name, coarse.faces[f].name);
  }
}

// The file in the source is the coarse one: it must not be written again.
TEST(SubdivideImport, WhatWasSplitIsANewFile) {
  const Scratch scratch;
  const std::string path = scratch.write("plate.obj", box_of_quads());
  ImportOptions options;
  options.largest_edge = 4e-3;
  const Surface fine = import_surface(path, options);
  EXPECT_TRUE(fine.sources[0].bytes.empty());
  ASSERT_EQ(refinement_notes(fine).size(), 1u);
  EXPECT_THAT(refinement_notes(fine)[0], ::testing::HasSubstr("plate.obj: its triangles were split"));
  const std::string out = scratch.path("out.obj");
  write_surface(fine, std::vector<Vec3>(fine.vertices.size(), Vec3::Zero()), surface_format("obj"), 1e-3,
                out);
  const Surface again = import_surface(out);
  EXPECT_EQ(again.polygon_count(), fine.polygon_count());
  EXPECT_EQ(again.faces.size(), 6u);
  options.largest_edge = 0.06;  // longer than the sides, and than the diagonals that would split the quads
  const Surface whole = import_surface(path, options);
  EXPECT_EQ(whole.polygon_count(), 6u);
  EXPECT_FALSE(whole.sources[0].bytes.empty());
}

TEST(SubdivideImport, ColoursAndNumbersGoAlong) {
  const Scratch scratch;
  const std::string path = scratch.write(
      "two.ply",
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
      "property double heat\nelement face 2\nproperty list uchar int vertex_indices\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nend_header\n"
      "0 0 0 1\n8 0 0 9\n8 8 0 17\n0 8 0 9\n3 0 1 2 255 0 0\n3 0 2 3 0 0 255\n");
  ImportOptions options;
  options.largest_edge = 1e-3;
  const Surface fine = import_surface(path, options);
  ASSERT_GT(fine.polygon_count(), 100u);
  const Column& heat = fine.vertex_columns.at("heat");
  ASSERT_EQ(heat.values.size(), fine.vertices.size());
  for (std::size_t v = 0; v < fine.vertices.size(); ++v)
    EXPECT_NEAR(heat.values[v], 1 + 1e3 * (fine.vertices[v].x() + fine.vertices[v].y()), 1e-9);
  const Column& color = fine.polygon_columns.at(kColorColumn);
  ASSERT_EQ(color.values.size(), 3 * fine.polygon_count());
  for (std::size_t p = 0; p < fine.polygon_count(); ++p) {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t v : fine.polygon(p)) middle += fine.vertices[v] / 3;
    EXPECT_EQ(color.values[3 * p], middle.y() < middle.x() ? 1 : 0);
  }
}

TEST(SubdivideImport, TooManyTrianglesAndNoLengthAreErrors) {
  const Scratch scratch;
  const std::string path = scratch.write("plate.stl", binary_stl(box_facets({0, 0, 0}, {40, 30, 2})));
  ImportOptions options;
  options.largest_edge = 1e-6;
  EXPECT_THAT(import_error(path, options), ::testing::HasSubstr("give a larger --edge"));
  options.largest_edge = 0;
  EXPECT_THAT(import_error(path, options), ::testing::HasSubstr("above zero"));
}

#ifdef FLEXEL_STEP

TEST(SubdivideStep, PartsAreSplitToASixtyFourthOfTheirDiagonal) {
  SKIP_WITHOUT_PARTS();
  for (const char* file : less_if_sanitized<std::vector<const char*>>(
           {"4040_base_mount.step", "Moving_Jaw_SO101.step", "base_interface_AP203.STEP", "featuretype.STEP",
            "lower_leg_structure_fork.STEP"},
           {"4040_base_mount.step", "base_interface_AP203.STEP"}, "two parts of five")) {
    SCOPED_TRACE(file);
    ImportOptions whole;
    whole.largest_edge = std::numeric_limits<double>::infinity();
    const Surface coarse = import_surface(part_path(file), whole), fine = import_surface(part_path(file));
    const double diagonal = bounding_box(coarse.vertices).diagonal();
    EXPECT_GT(longest_edge(coarse), diagonal / 64);
    EXPECT_LE(longest_edge(fine), diagonal / 64 * (1 + 1e-12));
    EXPECT_LT(fine.polygon_count(), 400'000u);
    expect_same_solid(coarse, fine);
  }
}

// A lattice has one spacing for all parts: a nut needs no edges of a 64th of itself.
TEST(SubdivideStep, AnAssemblyIsSplitToASixtyFourthOfItsWhole) {
  SKIP_WITHOUT_PARTS();
  ImportOptions whole;
  whole.largest_edge = std::numeric_limits<double>::infinity();
  const std::string path = part_path("as1-oc-214.stp");
  const Surface coarse = import_surface(path, whole), fine = import_surface(path);
  EXPECT_EQ(fine.parts.size(), 18u);
  EXPECT_LE(longest_edge(fine), bounding_box(coarse.vertices).diagonal() / 64 * (1 + 1e-12));
  EXPECT_LT(fine.polygon_count(), 300'000u);  // 1,170,000 when each solid's own diagonal counted
  EXPECT_NEAR(shape(fine).volume / shape(coarse).volume, 1, 1e-12);
}

TEST(SubdivideStep, TheLargestEdgeIsTheUsersAndTooManyTrianglesAreAnError) {
  SKIP_WITHOUT_PARTS();
  const std::string path = part_path("red_cube_blue_cylinder.step");
  ImportOptions options;
  options.largest_edge = 5e-4;
  EXPECT_LE(longest_edge(import_surface(path, options)), 5e-4);
  options.largest_edge = 1e-7;
  EXPECT_THAT(import_error(path, options), ::testing::HasSubstr("give a larger --edge"));
  options.largest_edge = 0;
  EXPECT_THAT(import_error(path, options), ::testing::HasSubstr("above zero"));
}

#endif

}  // namespace
}  // namespace flexel::test
