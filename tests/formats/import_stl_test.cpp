#include <cstring>
#include <limits>

#include <gmock/gmock.h>

#include "base/parallel.h"
#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;

const Facets& unit_box() {
  static const Facets facets = box_facets({0, 0, 0}, {1, 2, 4});
  return facets;
}

std::string ascii_solid(const std::string& name, const Facets& facets, const std::string& newline = "\n") {
  std::string text = "solid " + name + newline;
  for (const auto& facet : facets) {
    text += " facet normal 0 0 nan" + newline + "  outer loop" + newline;
    for (const auto& c : facet)
      text += "   vertex " + std::to_string(c[0]) + " +" + std::to_string(c[1]) + "\t" +
              std::to_string(c[2]) + "E-000" + newline;
    text += "  endloop" + newline + " endfacet" + newline;
  }
  return text + "endsolid " + name + newline;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

void expect_box(const Surface& surface, const std::string& what) {
  EXPECT_EQ(surface.polygon_count(), 12u) << what;
  EXPECT_EQ(surface.vertices.size(), 8u) << what;
  EXPECT_EQ(surface.faces.size(), 6u) << what;
  const Shape found = shape(surface);
  EXPECT_TRUE(found.topology.closed() && found.topology.oriented()) << what;
  EXPECT_NEAR(found.volume, 8e-9, 1e-20) << what;
}

TEST(ImportStl, EveryKindOfBoxIsTheSameBox) {
  const Scratch scratch;
  const std::string binary = binary_stl(unit_box());
  const std::string ascii = ascii_solid("box", unit_box());
  const std::vector<std::pair<std::string, std::string>> files{
      {"binary", binary},
      {"binary that begins with solid", binary_stl(unit_box(), "solid facet normal 0 0 1")},
      {"binary with trailing bytes", binary + std::string(33, 'x')},
      {"binary that begins with solid, trailing bytes", binary_stl(unit_box(), "solid box") + "xyz"},
      {"binary with count 0", binary_stl(unit_box(), "", 0)},
      {"ascii", ascii},
      {"ascii in upper case", upper(ascii)},
      {"ascii with CRLF", ascii_solid("box", unit_box(), "\r\n")},
      {"ascii with CR only", ascii_solid("", unit_box(), "\r")},
      {"ascii behind blanks", "\n  " + ascii + "\n\x1a"},
  };
  for (const auto& [what, content] : files) {
    expect_box(import_surface(scratch.write("a.stl", content)), what);
  }
}

TEST(ImportStl, TheContentTellsTheFormatWhateverTheName) {
  const Scratch scratch;
  expect_box(import_surface(scratch.write("noextension", binary_stl(unit_box()))), "binary");
  expect_box(import_surface(scratch.write("wrong.obj", ascii_solid("a", unit_box()))), "ascii");
}

// Mesh generators write a body's boundary as one solid a patch: closed only when read together.
TEST(ImportStl, SolidsThatCloseOnlyTogetherAreOnePart) {
  const Scratch scratch;
  const Facets box = unit_box();
  const Facets rest(box.begin() + 4, box.end()), bottom(box.begin(), box.begin() + 2),
      top(box.begin() + 2, box.begin() + 4);
  const std::string other = ascii_solid("other", box_facets({5, 0, 0}, {6, 2, 4}));
  const Surface surface =
      import_surface(scratch.write("patched.stl", ascii_solid("inlet", bottom) + ascii_solid("wall", rest) +
                                                      other + ascii_solid("outlet", top)));
  ASSERT_EQ(surface.parts.size(), 2u);
  EXPECT_EQ(surface.parts[0].name, "patched");
  EXPECT_EQ(surface.parts[1].name, "other");
  EXPECT_EQ(surface.vertices.size(), 16u);
  EXPECT_TRUE(shape(surface).topology.closed());
  ASSERT_EQ(surface.faces.size(), 3u + 6u);
  EXPECT_EQ(surface.faces[0].name, "inlet");
  EXPECT_EQ(surface.faces[1].name, "wall");
  EXPECT_EQ(surface.faces[2].name, "outlet");
  // Each alone stays what it is: an open part.
  EXPECT_EQ(import_surface(scratch.write("open.stl", ascii_solid("wall", rest) + other)).parts.size(), 2u);
}

TEST(ImportStl, TheRealFlangeOfFourPatchesIsOnePart) {
  SKIP_WITHOUT_PARTS();
  const Surface flange = import_surface(part_path("flange.stl"));
  ASSERT_EQ(flange.parts.size(), 1u);
  EXPECT_EQ(flange.parts[0].name, "flange");
  EXPECT_EQ(flange.faces.size(), 4u);
  EXPECT_TRUE(shape(flange).topology.closed());
}

TEST(ImportStl, SolidsBecomePartsThatShareNoVertex) {
  const Scratch scratch;
  const std::string text = ascii_solid("left leg", unit_box()) + "solid empty\nendsolid\n" +
                           ascii_solid("left leg", box_facets({1, 0, 0}, {2, 2, 4})) +
                           ascii_solid("", box_facets({5, 0, 0}, {6, 2, 4}));
  const Surface surface = import_surface(scratch.write("three.stl", text));
  ASSERT_EQ(surface.parts.size(), 3u);
  EXPECT_EQ(surface.parts[0].name, "left leg");
  EXPECT_EQ(surface.parts[1].name, "left leg-2");
  EXPECT_EQ(surface.parts[2].name, "three");
  EXPECT_EQ(surface.vertices.size(), 24u);
  EXPECT_EQ(surface.faces.size(), 18u);
  for (std::size_t p = 0; p < 36; ++p) EXPECT_EQ(surface.polygon_part(p), p / 12);
}

TEST(ImportStl, APathIsNoName) {
  const Scratch scratch;
  for (const auto& [given, name] : {std::pair{"/parts/arm.v2", "arm.v2"},
                                    {"C:\\parts\\left arm.STL", "left arm"},
                                    {"../arm.stl", "arm"},
                                    {"left/arm", "left/arm"},
                                    {"arm.step", "arm.step"},
                                    {"/", "file"}})
    EXPECT_EQ(import_surface(scratch.write("file.stl", ascii_solid(given, unit_box()))).parts[0].name, name);
}

TEST(ImportStl, AsciiKeepsDoublePrecisionAndTheUnitIsApplied) {
  const Scratch scratch;
  const std::string text =
      "solid\nfacet normal 0 0 0\nouter loop\nvertex 0.12345678901234567 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid\n";
  const std::string path = scratch.write("a.stl", text);
  EXPECT_EQ(import_surface(path).vertices[0].x(), 0.12345678901234567 * 1e-3);
  EXPECT_FALSE(import_surface(path).sources[0].unit_given);
  ImportOptions inches;
  inches.unit = 0.0254;
  const Surface surface = import_surface(path, inches);
  EXPECT_EQ(surface.vertices[1].x(), 0.0254);
  EXPECT_TRUE(surface.sources[0].unit_given);
  EXPECT_EQ(surface.sources[0].unit, 0.0254);
}

TEST(ImportStl, DegenerateTrianglesStayInPlaceAndMakeNoFace) {
  const Scratch scratch;
  Facets facets = unit_box();
  facets.insert(facets.begin(), {{{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}}}});
  facets.insert(facets.begin() + 5, {{{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}});
  const Surface surface = import_surface(scratch.write("a.stl", binary_stl(facets)));
  EXPECT_EQ(surface.polygon_count(), 14u);
  EXPECT_EQ(surface.faces.size(), 6u);
  EXPECT_EQ(shape(surface).topology.degenerate_triangles, 2u);
  EXPECT_TRUE(shape(surface).topology.closed());
}

TEST(ImportStl, SourceRemembersTheFile) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.stl", binary_stl(unit_box(), "made by hand")));
  const SurfaceSource& source = surface.sources.at(0);
  EXPECT_EQ(source.file, "a.stl");
  EXPECT_EQ(source.format, "stl-binary");
  ASSERT_EQ(source.stl_header.size(), 80u);
  EXPECT_EQ(std::memcmp(source.stl_header.data(), "made by hand", 13), 0);
  EXPECT_TRUE(source.bytes.empty());
}

TEST(ImportStl, BadFilesGiveOneClearError) {
  const Scratch scratch;
  const auto error = [&](const std::string& content) {
    return import_error(scratch.write("bad.stl", content));
  };
  const std::string binary = binary_stl(unit_box());
  EXPECT_THAT(error(binary.substr(0, 84 + 50 * 7 + 13)),
              HasSubstr("announces 12 triangles, 5 of them are missing"));
  EXPECT_THAT(error(binary_stl(unit_box(), "solid x").substr(0, 84 + 50 * 7)),
              HasSubstr("5 of them are missing"));
  EXPECT_THAT(error(binary.substr(0, 60)), HasSubstr("less than a header"));
  EXPECT_THAT(error(binary_stl({})), HasSubstr("no triangles"));
  Facets bad = unit_box();
  bad[8][1][2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error(binary_stl(bad)), HasSubstr("triangle 9 has a coordinate that is not a finite number"));
  EXPECT_THAT(error(ascii_solid("a", bad)), HasSubstr("triangle 9"));
  const std::string ascii = ascii_solid("a", unit_box());
  EXPECT_THAT(error(ascii.substr(0, ascii.size() / 2 + 30)), HasSubstr("cut off inside triangle 7"));
  EXPECT_THAT(error(ascii.substr(0, ascii.find("endsolid"))), HasSubstr("cut off after triangle 12"));
  EXPECT_THAT(error("solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 zero\n"),
              HasSubstr("bad.stl:4|triangle 1: \"zero\""));
  EXPECT_THAT(error("solid a\nendsolid a\n"), HasSubstr("no triangles"));
  EXPECT_THAT(error("solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 1e400\n"), HasSubstr("triangle 1"));
  EXPECT_THAT(error(ascii + "solids b"), HasSubstr("\"solids\""));
  EXPECT_THAT(error(binary_stl({{{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}}})), HasSubstr("one point"));
  EXPECT_THAT(import_error(scratch.path("absent.stl")), HasSubstr("absent.stl"));
  EXPECT_THAT(import_error(scratch.path("")), HasSubstr("folder"));
  EXPECT_THAT(error(""), HasSubstr("empty"));
  EXPECT_THAT(import_error(scratch.write("a.txt", "hello world, this is no part\n")),
              HasSubstr("no format that can be read"));
}

TEST(ImportStl, SameForAnyThreadCount) {
  const Scratch scratch;
  Facets facets;
  for (int i = 0; i < 2000; ++i) {
    const auto x = static_cast<float>(i % 40), y = static_cast<float>(i / 40);
    const Facets box = box_facets({x, y, 0}, {x + 1, y + 1, 1});
    facets.insert(facets.end(), box.begin(), box.end());
  }
  const std::string path = scratch.write("a.stl", binary_stl(facets));
  const ThreadLimit one(1);
  const Surface first = import_surface(path);
  const ThreadLimit many(4);
  const Surface second = import_surface(path);
  EXPECT_EQ(first.vertices, second.vertices);
  EXPECT_EQ(first.polygon_vertices, second.polygon_vertices);
  EXPECT_EQ(first.polygon_face, second.polygon_face);
}

struct ExpectedStl {
  const char* file;
  std::size_t triangles, vertices, shells, open, non_manifold, misoriented, parts;
};

// The numbers of the parts' README.
TEST(ImportStl, PartsHaveTheirDocumentedTopology) {
  SKIP_WITHOUT_PARTS();
  for (const ExpectedStl& e : {ExpectedStl{"lower_leg_structure_fork.STL", 46950, 23471, 1, 0, 0, 0, 1},
                               {"lower_leg_structure_200mm.STL", 25102, 12543, 1, 0, 0, 0, 1},
                               {"conrod.stl", 1044, 524, 3, 0, 0, 0, 1},
                               {"transmission_pulley_at3_t30_output.STL", 19054, 9523, 1, 0, 0, 0, 1},
                               {"hip_aa_module_shell_cover.STL", 50872, 25422, 1, 0, 0, 0, 1},
                               {"Springy_Trigger.STL", 8002, 3993, 1, 0, 0, 0, 1},
                               {"hook.stl", 7588, 3766, 1, 0, 0, 0, 1},
                               {"ADIS16480.STL", 7436, 3672, 1, 0, 0, 0, 1},
                               {"foot_structure.STL", 14676, 7373, 1, 140, 0, 0, 1},
                               {"angle_block.STL", 704, 398, 1, 166, 0, 0, 1},
                               {"multibody.stl", 32, 20, 2, 0, 0, 12, 2},
                               {"yarn_guide.stl", 252, 126, 1, 0, 1, 0, 1},
                               {"planar-geom-03.stl", 146, 92, 1, 36, 0, 0, 1}}) {
    const Surface surface = import_surface(part_path(e.file));
    const Topology found = shape(surface).topology;
    EXPECT_EQ(surface.polygon_count(), e.triangles) << e.file;
    EXPECT_EQ(surface.vertices.size(), e.vertices) << e.file;
    EXPECT_EQ(found.shell_count, e.shells) << e.file;
    EXPECT_EQ(found.open_edges, e.open) << e.file;
    EXPECT_EQ(found.non_manifold_edges, e.non_manifold) << e.file;
    EXPECT_EQ(found.misoriented_edges, e.misoriented) << e.file;
    EXPECT_EQ(surface.parts.size(), e.parts) << e.file;
  }
}

}  // namespace
}  // namespace flexel::test
