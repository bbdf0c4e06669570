#include <gmock/gmock.h>

#include <map>
#include <optional>

#include "base/parallel.h"
#include "tests/formats/import_help.h"
#include "tests/sanitized.h"

namespace flexel::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

#ifndef FLEXEL_STEP

TEST(ImportStep, WithoutOpenCascadeTheMessageSaysHowToGetIt) {
  const Scratch scratch;
  EXPECT_THAT(import_error(scratch.write("a.step", "ISO-10303-21;\nHEADER;\n")),
              AllOf(HasSubstr("no STEP support"), HasSubstr("-DFLEXEL_STEP=ON")));
}

#else

struct ExpectedSolid {
  const char* file;
  const char* part;
  std::size_t faces;
  std::uint32_t shells;
  double volume;  // mm^3 of the exact solid, by OpenCASCADE's BRepGProp::VolumeProperties at 1e-8
};

constexpr ExpectedSolid kSingles[] = {
    {"4040_base_mount.step", "SOARM100-4040-Adapter-V2", 178, 1, 45514.278},
    {"Moving_Jaw_SO101.step", "Moving_Jaw_SO101 v1", 189, 2, 20692.667},
    {"base_interface_AP203.STEP", "base_interface_AP203", 30, 1, 1257991.53},
    {"featuretype.STEP", "featuretype", 96, 1, 190447.659},
    {"lower_leg_structure_fork.STEP", "lower_leg_structure_fork", 118, 1, 4184.13685}};

TEST(ImportStep, PartsAreClosedAndHaveTheirSolidsVolume) {
  SKIP_WITHOUT_PARTS();
  for (const ExpectedSolid& e : kSingles) {
    const Surface surface = import_surface(part_path(e.file));
    const Shape found = shape(surface);
    ASSERT_EQ(surface.parts.size(), 1u) << e.file;
    EXPECT_EQ(surface.parts[0].name, e.part);
    EXPECT_EQ(surface.faces.size(), e.faces) << e.file;
    EXPECT_TRUE(found.topology.closed() && found.topology.oriented()) << e.file;
    EXPECT_EQ(found.topology.shell_count, e.shells) << e.file;
    EXPECT_NEAR(found.volume * 1e9 / e.volume, 1, 2e-3) << e.file;
    EXPECT_EQ(surface.sources.at(0).unit, 1e-3);
    EXPECT_TRUE(surface.sources.at(0).unit_given);
  }
}

TEST(ImportStep, EveryFaceHasTrianglesAndNoVertexIsUnused) {
  SKIP_WITHOUT_PARTS();
  const Surface surface = import_surface(part_path("4040_base_mount.step"));
  std::vector<int> used_faces(surface.faces.size()), used(surface.vertices.size());
  for (const std::uint32_t f : surface.polygon_face) ++used_faces[f];
  for (const std::uint32_t v : surface.polygon_vertices) ++used[v];
  EXPECT_THAT(used_faces, Not(::testing::Contains(0)));
  EXPECT_THAT(used, Not(::testing::Contains(0)));
}

TEST(ImportStep, AFinerDeflectionComesNearerToTheSolid) {
  SKIP_WITHOUT_PARTS();
  const std::string path = part_path("lower_leg_structure_fork.STEP");
  ImportOptions fine;
  fine.deflection = 2e-6;
  fine.angular_deflection = 0.05;
  fine.largest_edge = 1;
  const Shape found = shape(import_surface(path, fine));
  EXPECT_TRUE(found.topology.closed());
  EXPECT_NEAR(found.volume * 1e9 / 4184.13685, 1, 5e-5);
}

// A cavity's shell runs the other way round, so that its volume counts against the outer one's.
TEST(ImportStep, AVoidShellIsInsideOut) {
  SKIP_WITHOUT_PARTS();
  const Surface surface = import_surface(part_path("Moving_Jaw_SO101.step"));
  const Shape found = shape(surface);
  std::array<std::vector<std::array<std::uint32_t, 3> >, 2> shells;
  for (std::size_t t = 0; t < found.triangles.corners.size(); ++t)
    shells.at(found.topology.shell[t]).push_back(found.triangles.corners[t]);
  const double first = signed_volume(surface.vertices, shells[0]),
               second = signed_volume(surface.vertices, shells[1]);
  EXPECT_LT(first * second, 0);
  EXPECT_GT(first + second, 0);
}

TEST(ImportStep, UnitsOfTheFileBecomeMetresExactly) {
  SKIP_WITHOUT_PARTS();
  // In metres: a cube of 10 mm.
  const Surface two = import_surface(part_path("red_cube_blue_cylinder.step"));
  ASSERT_EQ(two.parts.size(), 2u);
  EXPECT_EQ(two.parts[0].name, "blue_cylinder");
  EXPECT_EQ(two.parts[1].name, "red_cube");
  Box cube;
  for (std::size_t p = 0; p < two.polygon_count(); ++p)
    if (two.polygon_part(p) == 1)
      for (const std::uint32_t v : two.polygon(p)) cube.add(two.vertices[v]);
  EXPECT_NEAR((cube.size() - Vec3::Constant(0.01)).norm(), 0, 1e-15);
  // In inches: a plate of 3/16 inch.
  const Surface plate = import_surface(part_path("base_interface_AP203.STEP"));
  EXPECT_NEAR(bounding_box(plate.vertices).size().z(), 0.1875 * 0.0254, 1e-15);
  ImportOptions options;
  options.unit = 0.0254;
  EXPECT_THAT(import_error(part_path("base_interface_AP203.STEP"), options), HasSubstr("leave out --unit"));
}

TEST(ImportStep, SameForAnyThreadCountAndSilentOnStdout) {
  SKIP_WITHOUT_PARTS();
  const std::string path =
      part_path(less_if_sanitized("featuretype.STEP", "base_interface_AP203.STEP", "a smaller part"));
  ::testing::internal::CaptureStdout();
  const ThreadLimit one(1);
  const Surface first = import_surface(path);
  const ThreadLimit many(4);
  const Surface second = import_surface(path);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(first.vertices, second.vertices);
  EXPECT_EQ(first.polygon_vertices, second.polygon_vertices);
  EXPECT_EQ(first.polygon_face, second.polygon_face);
}

// As Creo writes its degrees; every file of it was refused as damaged.
TEST(ImportStep, UnitsWithoutDimensionsAreRead) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  const std::string text = read_file(part_path("red_cube_blue_cylinder.step"));
  const Surface sound = import_surface(part_path("red_cube_blue_cylinder.step"));
  const Surface read =
      import_surface(scratch.write("a.step", replaced(text, "NAMED_UNIT( #68 )", "NAMED_UNIT( * )")));
  EXPECT_EQ(read.vertices, sound.vertices);
}

TEST(ImportStep, AClosedShellStandsForASolid) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  std::string text = read_file(part_path("red_cube_blue_cylinder.step"));
  text = replaced(text, "MANIFOLD_SOLID_BREP( 'red_cube', #111 )",
                  "SHELL_BASED_SURFACE_MODEL( 'red_cube', ( #111 ) )");
  text = replaced(text, "MANIFOLD_SOLID_BREP( 'blue_cylinder', #106 )",
                  "SHELL_BASED_SURFACE_MODEL( 'b', ( #106 ) )");
  const Surface surface = import_surface(scratch.write("shells.step", text));
  EXPECT_EQ(surface.parts.size(), 2u);
  EXPECT_TRUE(shape(surface).topology.closed());
  EXPECT_GT(shape(surface).volume, 1.7e-6);
}

TEST(ImportStep, DamagedFilesGiveOneClearError) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  const auto error = [&](const std::string& content) {
    return import_error(scratch.write("bad.step", content));
  };
  const std::string text = read_file(part_path("red_cube_blue_cylinder.step"));
  EXPECT_THAT(error(text.substr(0, text.size() / 2)), HasSubstr("is cut off"));
  EXPECT_THAT(error("ISO-10303-21;\nHEADER;\ngarbage\nENDSEC;\nEND-ISO-10303-21;\n"), HasSubstr("bad.step|"));
  EXPECT_THAT(error(replaced(text, "MANIFOLD_SOLID_BREP( 'red_cube', #111 )",
                             "MANIFOLD_SOLID_BREP( 'red_cube', #38 )")),
              HasSubstr("is damaged"));
  ImportOptions step;
  step.format = "step";
  EXPECT_THAT(import_error(scratch.write("a.stl", "solid a\n"), step), HasSubstr("is no STEP file"));
}

// What OpenCASCADE complains of but loads whole opens with a warning, as it does in gmsh.
TEST(ImportStep, HarmlessDamageIsAWarning) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  const std::string text = read_file(part_path("red_cube_blue_cylinder.step"));
  std::vector<std::string> warnings;
  ImportOptions options;
  options.warn = [&](const std::string& line) { warnings.push_back(line); };
  const Surface sound = import_surface(part_path("red_cube_blue_cylinder.step"), options);
  EXPECT_TRUE(warnings.empty());
  const Surface surface =
      import_surface(scratch.write("named.step", replaced(text, "PLANE( ''", "PLANE( 5")), options);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0],
              HasSubstr("(name) not a quoted String\"; its solids are closed and valid all the same"));
  EXPECT_EQ(surface.vertices, sound.vertices);
}

TEST(ImportStep, TessellatedSolidsAreNamed) {
  SKIP_WITHOUT_PARTS();
  EXPECT_THAT(import_error(part_path("ap242_tessellated.stp")),
              HasSubstr("holds tessellated geometry only (TESSELLATED_SOLID), which OpenCASCADE"));
}

// Whatever single line is lost, the result is an error or a sound part; never a crash, never half a solid.
TEST(ImportStep, ALostLineNeverGivesHalfASolid) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  const std::string text = read_file(part_path("red_cube_blue_cylinder.step"));
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    lines.push_back(text.substr(at, end - at + 1));
    at = end == std::string::npos ? text.size() : end + 1;
  }
  const double whole = shape(import_surface(part_path("red_cube_blue_cylinder.step"))).volume;
  // A start of flexel-cad takes a second there.
  const auto every = less_if_sanitized<std::size_t>(5, 64, "one line of 64 is lost");
  std::size_t refused = 0;
  for (std::size_t lost = 8; lost < lines.size(); lost += every) {
    std::string damaged;
    for (std::size_t i = 0; i < lines.size(); ++i)
      if (i != lost) damaged += lines[i];
    ImportOptions whole_edges;
    whole_edges.largest_edge = 1;  // m: nothing to split
    bool warned = false;
    whole_edges.warn = [&](const std::string&) { warned = true; };
    const std::string path = scratch.write("lost.step", damaged);
    std::optional<Surface> surface;
    try {
      surface = import_surface(path, whole_edges);
    } catch (const InputError&) {
      ++refused;
      continue;
    }
    const Shape found = shape(*surface);
    EXPECT_TRUE(found.topology.closed()) << lines[lost];
    if (!warned) {
      EXPECT_NEAR(found.volume / whole, 1, 1e-9) << lines[lost];
    }
  }
  EXPECT_GT(refused, 40 / every);
}

// OpenCASCADE's parser recurses until its stack is full, within malloc at times.
TEST(ImportStep, NestingWithoutEndIsDamageAndNoHang) {
  const Scratch scratch;
  const std::string deep(100000, '(');
  const std::string path = scratch.write(
      "deep.step",
      "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
      "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n#1=CARTESIAN_POINT('',(" +
          deep + "0." + std::string(deep.size(), ')') + "));\nENDSEC;\nEND-ISO-10303-21;\n");
  EXPECT_THAT(import_error(path), HasSubstr("deep.step|is damaged: OpenCASCADE cannot read it"));
}

#endif

}  // namespace
}  // namespace flexel::test
