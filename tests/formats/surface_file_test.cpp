#include "formats/exchange/surface_file.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cstring>
#include <random>
#include <tuple>

#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::vector<Vec3> random_motion(const Surface& surface, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> pick(-1e-3, 1e-3);
  std::vector<Vec3> motion;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    motion.emplace_back(pick(random), pick(random), pick(random));
  return motion;
}

std::string written(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                    const Scratch& scratch, double unit = 0) {
  const std::string path = scratch.path("written");
  write_surface(surface, displacement, format, unit > 0 ? unit : default_unit(surface), path);
  return read_file(path);
}

// The positions of the triangles, in order, which is all that an STL says.
std::vector<Vec3> soup(const Surface& surface) {
  std::vector<Vec3> corners;
  for (const auto& t : triangulate(surface).corners)
    for (const std::uint32_t v : t) corners.push_back(surface.vertices[v]);
  return corners;
}

double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  if (a.size() != b.size()) return 1e300;
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

TEST(SurfaceFile, BinaryStlThatDidNotMoveHasTheSameBytesButForNormals) {
  const Scratch scratch;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> pick(-300, 300);
  Facets facets(500);
  for (auto& facet : facets)
    for (auto& corner : facet)
      for (float& value : corner) value = pick(random);
  const std::string original = binary_stl(facets, "a header of theirs");
  for (const double unit : {1e-3, 1.0, 0.0254}) {
    ImportOptions options;
    options.unit = unit;
    const Surface surface = import_surface(scratch.write("a.stl", original), options);
    std::string bytes = written(surface, nothing(surface), surface_format("stl"), scratch);
    ASSERT_EQ(bytes.size(), original.size());
    for (std::size_t t = 0; t < facets.size(); ++t) {
      Eigen::Vector3f normal;
      std::memcpy(normal.data(), bytes.data() + 84 + 50 * t, 12);  // records are not aligned
      EXPECT_NEAR(normal.norm(), 1, 1e-6);
      bytes.replace(84 + 50 * t, 12, 12, '\0');
    }
    EXPECT_EQ(bytes, original);
  }
}

TEST(SurfaceFile, StlHeaderIsTheirsOrOursButOursNeverBeginsWithSolid) {
  const Scratch scratch;
  const Facets box = box_facets({0, 0, 0}, {1, 1, 1});
  const Surface solid = import_surface(scratch.write("a.stl", binary_stl(box, "solid theirs")));
  EXPECT_THAT(written(solid, nothing(solid), surface_format("stl"), scratch), StartsWith("solid theirs"));
  const Surface obj = import_surface(scratch.write("solid.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_THAT(written(obj, nothing(obj), surface_format("stl"), scratch), StartsWith("Flexel"));
}

TEST(SurfaceFile, EveryFormatBringsBackTheMovedPartInOrder) {
  const Scratch scratch;
  const std::string stl = scratch.write("a.stl", binary_stl(box_facets({0, 0, 0}, {10, 20, 40})));
  Surface surface = import_surface(stl);
  const std::vector<Vec3> motion = random_motion(surface);
  Surface moved = surface;
  for (std::size_t v = 0; v < motion.size(); ++v) moved.vertices[v] += motion[v];
  for (const auto& [format, name, tolerance] : {std::tuple{surface_format("stl"), "b.stl", 1e-8},
                                                {surface_format("stl", "", true), "b.stl", 1e-17},
                                                {surface_format("obj"), "b.obj", 1e-17}}) {
    write_surface(surface, motion, format, 1e-3, scratch.path(name));
    EXPECT_LE(largest_difference(soup(import_surface(scratch.path(name))), soup(moved)), tolerance);
  }
  const double inch = 0.0254;
  write_surface(surface, motion, surface_format("obj"), inch, scratch.path("inch.obj"));
  ImportOptions inches;
  inches.unit = inch;
  EXPECT_LE(largest_difference(soup(import_surface(scratch.path("inch.obj"), inches)), soup(moved)), 1e-17);
}

TEST(SurfaceFile, AsciiStlKeepsSolidsNamesAndTheFilesOwnDigits) {
  const Scratch scratch;
  const std::string text =
      "solid left\n facet normal 0 0 1\n  outer loop\n   vertex 0.1 0.2 0.3\n   vertex 1.7 0 -12.34\n   "
      "vertex 1e-05 1 0\n"
      "  endloop\n endfacet\nendsolid left\nsolid right wing\n facet normal 0 0 1\n  outer loop\n   vertex 5 "
      "0 0\n"
      "   vertex 6 0 0\n   vertex 5.123456 1 0\n  endloop\n endfacet\nendsolid right wing\n";
  const Surface surface = import_surface(scratch.write("a.stl", text));
  const std::string again = written(surface, nothing(surface), surface_format("stl", "", true), scratch);
  for (const char* line :
       {"solid left\n", "vertex 0.1 0.2 0.3\n", "vertex 1.7 0 -12.34\n", "vertex 1e-05 1 0\n",
        "endsolid left\nsolid right wing\n", "vertex 5.123456 1 0\n", "endsolid right wing\n"})
    EXPECT_THAT(again, HasSubstr(line));
  EXPECT_EQ(written(import_surface(scratch.write("b.stl", again)), nothing(surface),
                    surface_format("stl", "", true), scratch),
            again);
}

const char* const kAwkwardObj =
    "# made by hand\r\nmtllib absent.mtl\r\no thing\r\n  v  0.10 0 0 0.5 0.5 0.5 # red\r\nv 1.0e0\t0 \\\r\n "
    "0 1.0\r\n"
    "v 1 1 0\r\nv 0 1 0\r\nv 7 7 7.000\r\nvt 0 0\r\nvn 0.000 0 1.0\r\nvn 1 0 0\r\n"
    "g a\r\nusemtl m\r\ns 1\r\nf 1/1/1 2/1/1 3/1/1 \\\r\n 4/1/1\r\ng b\r\nf 4 3 -5\r\nl 1 2\r\n\r\n# the end";

TEST(SurfaceFile, AnObjThatDidNotMoveIsTheSameByteForByte) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.obj", kAwkwardObj));
  EXPECT_EQ(written(surface, nothing(surface), surface_format("obj"), scratch), kAwkwardObj);
}

TEST(SurfaceFile, OnlyCoordinatesThatMovedAreRewrittenInAnObj) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.obj", kAwkwardObj));
  std::vector<Vec3> motion = nothing(surface);
  motion[1] = Vec3(0, 0.5e-3, 0);
  std::string expected = kAwkwardObj;
  const std::string before = "v 1.0e0\t0 \\\r\n 0 1.0\r\n", after = "v 1.0e0\t0.5 \\\r\n 0 1.0\r\n";
  expected.replace(expected.find(before), before.size(), after);
  EXPECT_EQ(written(surface, motion, surface_format("obj"), scratch), expected);
}

TEST(SurfaceFile, NormalsOfAnObjTurnWithTheirPolygonsAndKeepTheirLength) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.obj", kAwkwardObj));
  const Eigen::AngleAxisd quarter(std::acos(-1.0) / 2, Vec3::UnitX());
  std::vector<Vec3> motion;
  for (const Vec3& v : surface.vertices) motion.push_back(quarter * v - v);
  const std::string text = written(surface, motion, surface_format("obj"), scratch);
  const std::size_t at = text.find("vn ");
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(std::sscanf(text.c_str() + at, "vn %lf %lf %lf", &x, &y, &z), 3);
  EXPECT_NEAR((Vec3(x, y, z) - Vec3(0, -1, 0)).norm(), 0, 1e-8);
  EXPECT_THAT(text, HasSubstr("vn 1 0 0\r\n"));  // used by no polygon
  const std::vector<Vec3> shift(surface.vertices.size(), Vec3(1e-3, 2e-3, 0.3e-3));
  EXPECT_THAT(written(surface, shift, surface_format("obj"), scratch), HasSubstr("vn 0.000 0 1.0\r\n"));
}

TEST(SurfaceFile, ObjInAnotherUnitScalesEveryVertex) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.obj", "v 1 2 3\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_THAT(written(surface, nothing(surface), surface_format("obj"), scratch, 1.0),
              HasSubstr("v 0.001 0.002 0.003\n"));
}

TEST(SurfaceFile, FormatsAreChosenByNameOrExtension) {
  const auto error = [](const std::string& format, const std::string& path,
                        bool ascii = false) -> std::string {
    try {
      static_cast<void>(surface_format(format, path, ascii));
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(surface_format("", "a.STL", false), surface_format("stl"));
  EXPECT_EQ(surface_format("", "a.stl", true), surface_format("stl", "", true));
  EXPECT_EQ(surface_format("obj", "-", false), surface_format("obj"));
  EXPECT_EQ(surface_format("stl", "a.obj", false), surface_format("stl"));
  EXPECT_THAT(error("", "-"), HasSubstr("a pipe needs --format"));
  EXPECT_THAT(error("", "name"), HasSubstr("--format"));
  EXPECT_THAT(error("", "a.step"), HasSubstr("cannot be written as \"step\""));
  EXPECT_THAT(error("ojb", "a.stl"), HasSubstr("did you mean \"obj\""));
  EXPECT_THAT(error("obj", "-", true), HasSubstr("--ascii"));
}

TEST(SurfaceFile, WhatDoesNotFitIsRefusedAndNothingIsLeft) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.obj", "v 1 2 3\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  std::vector<Vec3> motion = nothing(surface);
  motion[1].x() = 1e37;
  EXPECT_THROW(write_surface(surface, motion, surface_format("stl"), 1e-3, scratch.path("out.stl")),
               InputError);
  motion[1].x() = std::nan("");
  EXPECT_THROW(write_surface(surface, motion, surface_format("obj"), 1e-3, scratch.path("out.obj")),
               InputError);
  EXPECT_FALSE(std::filesystem::exists(scratch.path("out.stl")));
  EXPECT_FALSE(std::filesystem::exists(scratch.path("out.obj")));
}

TEST(SurfaceFile, PartsComeBackFromEveryFormat) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  for (const char* name :
       {"rabbit.obj", "quadknot.obj", "spot_quadrangulated.obj", "openscad-nonmanifold-crash.obj"}) {
    const Surface surface = import_surface(part_path(name));
    EXPECT_EQ(written(surface, nothing(surface), surface_format("obj"), scratch), read_file(part_path(name)))
        << name;
  }
  for (const char* name : {"conrod.stl", "ADIS16480.STL", "multibody.stl", "rabbit.obj"}) {
    const Surface surface = import_surface(part_path(name));
    write_surface(surface, nothing(surface), surface_format("stl", "", true), 1e-3, scratch.path("a.stl"));
    EXPECT_EQ(largest_difference(soup(import_surface(scratch.path("a.stl"))), soup(surface)), 0) << name;
  }
}

}  // namespace
}  // namespace flexel::test
