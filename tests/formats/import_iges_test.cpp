// IGES and BREP: files of a bracket that OpenCASCADE writes.
#include <gmock/gmock.h>

#include "tests/formats/import_help.h"
#include "tests/formats/occt_files.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;

#ifdef FLEXEL_STEP

constexpr double kVolume = (40.0 * 30 - 30 * 20) * 20 * 1e-9;  // m^3

void expect_bracket(const Surface& surface, double scale, const std::string& what) {
  const Shape found = shape(surface);
  ASSERT_EQ(surface.parts.size(), 1u) << what;
  EXPECT_EQ(surface.faces.size(), 8u) << what;
  EXPECT_TRUE(found.topology.closed() && found.topology.oriented()) << what;
  EXPECT_NEAR(found.volume / (kVolume * scale * scale * scale), 1, 1e-9) << what;
  EXPECT_NEAR((bounding_box(surface.vertices).size() - Vec3(0.04, 0.03, 0.02) * scale).norm(), 0, 1e-9)
      << what;
}

TEST(ImportIges, SolidsAndLooseSurfacesBecomeTheSolid) {
  const Scratch scratch;
  ::testing::internal::CaptureStdout();
  for (const char* unit : {"MM", "INCH", "M"})
    for (const bool solid : {true, false}) {
      write_bracket_iges(scratch.path("a.igs"), solid, unit);
      const Surface surface = import_surface(scratch.path("a.igs"));
      expect_bracket(surface, 1, std::string(unit) + (solid ? " solid" : " surfaces"));
      EXPECT_EQ(surface.sources[0].format, "iges");
      EXPECT_TRUE(surface.sources[0].unit_given);
    }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

TEST(ImportIges, DamageIsNamed) {
  const Scratch scratch;
  write_bracket_iges(scratch.path("a.igs"), true);
  const std::string text = read_file(scratch.path("a.igs"));
  const auto error = [&](const std::string& content) {
    return import_error(scratch.write("b.igs", content));
  };
  EXPECT_THAT(error(text.substr(0, text.size() / 2)), HasSubstr("is cut off"));
  EXPECT_THAT(error(text.substr(0, 81) + text.substr(text.size() - 81)), HasSubstr("b.igs|"));
  ImportOptions options;
  options.unit = 1e-3;
  EXPECT_THAT(import_error(scratch.path("a.igs"), options), HasSubstr("leave out --unit"));
  options = {};
  options.format = "iges";
  EXPECT_THAT(import_error(scratch.write("c.txt", "nothing"), options), HasSubstr("is no IGES file"));
}

TEST(ImportBrep, TextAndBinaryTakeTheUsersUnit) {
  const Scratch scratch;
  for (const bool binary : {false, true}) {
    write_bracket_brep(scratch.path("a.brep"), binary);
    expect_bracket(import_surface(scratch.path("a.brep")), 1, binary ? "binary" : "text");
    ImportOptions inch;
    inch.unit = 0.0254;
    expect_bracket(import_surface(scratch.path("a.brep"), inch), 25.4, "inch");
  }
}

TEST(ImportBrep, DamageIsNamed) {
  const Scratch scratch;
  write_bracket_brep(scratch.path("a.brep"), false);
  const std::string text = read_file(scratch.path("a.brep"));
  for (std::size_t size = 40; size < text.size() - 60; size += text.size() / 40)
    EXPECT_THAT(import_error(scratch.write("b.brep", text.substr(0, size))), HasSubstr("b.brep|is ")) << size;
  std::string counts = text;
  counts.replace(counts.find("\nCurves "), 9, "\nCurves 99999999");
  EXPECT_THAT(import_error(scratch.write("c.brep", counts)), HasSubstr("wrong length"));
}

TEST(ImportBrep, TimeAndMemoryHaveLimits) {
  const Scratch scratch;
  write_ball_brep(scratch.path("a.brep"));
  ImportOptions little_memory, little_time;
  little_memory.deflection = 1e-9;
  little_memory.occt_memory = 2e7;
  EXPECT_THAT(import_error(scratch.path("a.brep"), little_memory),
              HasSubstr("wants more memory than it gets"));
  little_time.occt_seconds = 1e-6;
  EXPECT_THAT(import_error(scratch.path("a.brep"), little_time), HasSubstr("s of processor time"));
}

#endif

}  // namespace
}  // namespace flexel::test
