#include <gmock/gmock.h>

#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;

TEST(ImportObj, VerticesKeepTheirOrderAndPrecisionUsedOrNot) {
  const Scratch scratch;
  const Surface surface = import_surface(
      scratch.write("a.obj",
                    "v 9 9 9\nv 0.12345678901234567 0 0\nv 1 0 0 0.5 0.25 0.125\nv 1 +1 0 1.0\n"
                    "v 0 1e-400 -0\nf 2 3 4\n"));
  ASSERT_EQ(surface.vertices.size(), 5u);
  EXPECT_EQ(surface.vertices[1].x(), 0.12345678901234567 * 1e-3);
  EXPECT_EQ(surface.vertices[3], Vec3(1, 1, 0) * 1e-3);
  EXPECT_EQ(surface.vertices[4], Vec3(0, 0, 0));
  EXPECT_EQ(surface.parts.at(0).name, "a");
  EXPECT_EQ(surface.sources.at(0).format, "obj");
}

TEST(ImportObj, PolygonsStayPolygonsWhateverTheirNotation) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write(
      "a.obj",
      "# comment\r\nmtllib absent.mtl\r\nv 0 0 0\r\nv 1 0 0 # here\r\nv 1 1 0\r\nv 0 1 \\\r\n0\r\n"
      "vt 0 0\r\nvn 0 0 1\r\nusemtl red\r\ns off\r\nl 1 2\r\np 3\r\n"
      "f 1/1/1 2/1/1 3/1/1 4/1/1\r\nf -4//-1 -3//-1 -2//-1\r\nf 1/1 2/1 \\\r\n 3/1 4/1\r\nf 1 2 3 4"));
  EXPECT_EQ(surface.polygon_offsets, (std::vector<std::uint32_t>{0, 4, 7, 11, 15}));
  EXPECT_EQ(surface.polygon_vertices,
            (std::vector<std::uint32_t>{0, 1, 2, 3, 0, 1, 2, 0, 1, 2, 3, 0, 1, 2, 3}));
}

TEST(ImportObj, NegativeIndicesCountFromWhereTheyStand) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write(
      "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -4 -1 -3\nf 1 2 5\nv 1 1 1\n"));
  EXPECT_EQ(surface.polygon_vertices, (std::vector<std::uint32_t>{0, 1, 2, 0, 3, 1, 0, 1, 4}));
}

TEST(ImportObj, GroupsAreFacesAndReturnToTheirFace) {
  const Scratch scratch;
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const Surface surface = import_surface(
      scratch.write("a.obj", vertices + "f 1 2 3\ng left side\nf 1 2 3\no lid\nf 1 2 3\ng left side\n"
                                        "f 1 2 3\no\ng left side\nf 1 2 3\n"));
  std::vector<std::string> names;
  for (const auto& face : surface.faces) names.push_back(face.name);
  EXPECT_EQ(names, (std::vector<std::string>{"", "left side", "lid", "left side"}));
  EXPECT_EQ(surface.polygon_face, (std::vector<std::uint32_t>{0, 1, 2, 3, 1}));
}

TEST(ImportObj, OneGroupAloneDividesNothingSoDihedralRegionsDo) {
  const Scratch scratch;
  const std::string cube =
      "o Cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
      "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  const Surface surface = import_surface(scratch.write("a.obj", cube));
  EXPECT_EQ(surface.faces.size(), 6u);
  EXPECT_EQ(surface.polygon_face, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}));
  EXPECT_NEAR(shape(surface).volume, 1e-9, 1e-20);
}

TEST(ImportObj, BadFilesGiveOneClearErrorWithTheLine) {
  const Scratch scratch;
  const auto error = [&](const std::string& content) {
    return import_error(scratch.write("bad.obj", content));
  };
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_THAT(error(triangle), HasSubstr("no faces"));
  EXPECT_THAT(error(triangle + "f 1 2 4\n"), HasSubstr("names vertex 4, but there are only 3"));
  EXPECT_THAT(error(triangle + "f 1 2 0\n"), HasSubstr("bad.obj:4|indices count from 1"));
  EXPECT_THAT(error(triangle + "f 1 2 -4\n"), HasSubstr("bad.obj:4|index -4"));
  EXPECT_THAT(error(triangle + "f 1 2\n"), HasSubstr("bad.obj:4|a face of 2 corners"));
  EXPECT_THAT(error(triangle + "f 1 2 x\n"), HasSubstr("\"x\" is not an index"));
  EXPECT_THAT(error(triangle + "f 1 2 99999999999999999999\n"), HasSubstr("not an index"));
  EXPECT_THAT(error(triangle + "f 1 2 9999999999\n"), HasSubstr("index out of range"));
  EXPECT_THAT(error("v 0 \\\n0\n" + triangle + "f 2 3 4\n"), HasSubstr("bad.obj:1|three numbers expected"));
  EXPECT_THAT(error("v 0 0 nan\n"), HasSubstr("not a finite number"));
  EXPECT_THAT(error("v 0 0 1e999\n"), HasSubstr("not a finite number"));
  EXPECT_THAT(error("v 0 0 1,5\n"), HasSubstr("\"1,5\" is not a number"));
}

struct ExpectedObj {
  const char* file;
  std::size_t triangles, vertices, polygons, shells, open, non_manifold, degenerate;
};

// The numbers of the parts' README. Its vertex counts are of welded vertices in use.
TEST(ImportObj, PartsHaveTheirDocumentedTopology) {
  SKIP_WITHOUT_PARTS();
  for (const ExpectedObj& e : {ExpectedObj{"spot_triangulated.obj", 5856, 2930, 5856, 1, 0, 0, 0},
                               {"spot_quadrangulated.obj", 5856, 2930, 2928, 1, 0, 0, 0},
                               {"quadknot.obj", 2880, 1440, 1440, 1, 0, 0, 0},
                               {"openscad-nonmanifold-crash.obj", 1442, 658, 1442, 2, 0, 18, 0},
                               {"rabbit.obj", 1252, 644, 678, 9, 0, 0, 0}}) {
    const Surface surface = import_surface(part_path(e.file));
    const Shape found = shape(surface);
    EXPECT_EQ(found.triangles.corners.size(), e.triangles) << e.file;
    EXPECT_EQ(surface.polygon_count(), e.polygons) << e.file;
    EXPECT_EQ(found.topology.shell_count, e.shells) << e.file;
    EXPECT_EQ(found.topology.open_edges, e.open) << e.file;
    EXPECT_EQ(found.topology.non_manifold_edges, e.non_manifold) << e.file;
    std::vector<std::uint32_t> used;
    const auto welded = weld(surface.vertices);
    for (const std::uint32_t v : surface.polygon_vertices) used.push_back(welded[v]);
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::unique(used.begin(), used.end()) - used.begin(), e.vertices) << e.file;
  }
  EXPECT_EQ(import_surface(part_path("rabbit.obj")).faces.size(), 9u);
}

}  // namespace
}  // namespace flexel::test
