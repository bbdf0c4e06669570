#include <gmock/gmock.h>

#include <algorithm>

#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;

// A tetrahedron with colours, a quality, a list, and things that are nobody's business.
constexpr const char* kAscii =
    "ply\nformat ascii 1.0\ncomment made by hand\nobj_info none\nelement vertex 4\nproperty double x\n"
    "property double y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property list uchar int tags\nproperty float quality\nelement face 4\n"
    "property list uchar int vertex_indices\nproperty int label\nelement edge 1\nproperty int a\nend_header\n"
    "0 0 0 255 0 0 0 1.5\n10 0 0 0 255 0 2 7 8 -2\n0 10 0 0 0 255 1 9 0\n0 0 10.123456789012345 51 102 0 0 "
    "1e3\n"
    "3 0 2 1 5\n3 0 1 3 6\n3 1 2 3 7\n3 2 0 3 8\n42\n";

TEST(ImportPly, KeepsOrderPrecisionColoursAndNumbers) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.ply", kAscii));
  EXPECT_EQ(surface.vertices.size(), 4u);
  EXPECT_EQ(surface.vertices[3].z(), 10.123456789012345 * 1e-3);
  EXPECT_EQ(surface.polygon_vertices, (std::vector<std::uint32_t>{0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}));
  EXPECT_EQ(surface.vertex_columns.size(), 2u);
  EXPECT_EQ(surface.vertex_columns.at("color").values,
            (std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0.2, 0.4, 0}));
  EXPECT_EQ(surface.vertex_columns.at("quality").values, (std::vector<double>{1.5, -2, 0, 1e3}));
  EXPECT_EQ(surface.polygon_columns.at("label").values, (std::vector<double>{5, 6, 7, 8}));
  EXPECT_EQ(surface.sources[0].format, "ply-ascii");
  EXPECT_FALSE(surface.sources[0].unit_given);
  EXPECT_EQ(surface.parts[0].name, "a");
  EXPECT_TRUE(shape(surface).topology.closed());
  ImportOptions inch;
  inch.unit = 0.0254;
  EXPECT_EQ(import_surface(scratch.path("a.ply"), inch).vertices[1].x(), 0.254);
}

// The same part in binary, in either byte order.
std::string binary_ply(bool big) {
  std::string data =
      std::string("ply\nformat binary_") + (big ? "big" : "little") +
      "_endian 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n"
      "property ushort red\nproperty ushort green\nproperty ushort blue\nproperty ushort alpha\n"
      "element face 4\nproperty list uint16 uint vertex_index\nend_header\n";
  const auto add = [&](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    if (big) std::reverse(bytes.begin(), bytes.end());
    data += bytes;
  };
  const std::array<std::array<double, 3>, 4> corners = {{{0, 0, 0}, {1, 0, 0}, {0, 0.1, 0}, {0, 0, 1}}};
  for (const auto& c : corners) {
    add(static_cast<float>(c[0]));
    add(c[1]);
    add(static_cast<float>(c[2]));
    for (const int channel : {65535, 0, 13107, 65535}) add(static_cast<std::uint16_t>(channel));
  }
  for (const auto& t : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
    add(std::uint16_t{3});
    for (const std::uint32_t v : t) add(v);
  }
  return data;
}

TEST(ImportPly, BinaryOfBothByteOrdersIsTheSame) {
  const Scratch scratch;
  const Surface little = import_surface(scratch.write("l.ply", binary_ply(false)));
  const Surface big = import_surface(scratch.write("b.ply", binary_ply(true)));
  EXPECT_EQ(little.vertices, big.vertices);
  EXPECT_EQ(little.polygon_vertices, big.polygon_vertices);
  EXPECT_EQ(little.vertices[2].y(), 0.1 * 1e-3);
  EXPECT_EQ(little.vertex_columns.at("color").components, 4);
  EXPECT_EQ(little.vertex_columns.at("color").values, big.vertex_columns.at("color").values);
  EXPECT_EQ(little.vertex_columns.at("color").values[2], 0.2);
  EXPECT_EQ(little.sources[0].format, "ply-binary");
}

TEST(ImportPly, DamageIsNamed) {
  const Scratch scratch;
  const auto error = [&](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return import_error(scratch.write("a.ply", text));
  };
  EXPECT_THAT(error(kAscii, "10 0 0 0 255", "nan 0 0 0 255"),
              HasSubstr("vertex 2: a coordinate is not a finite"));
  EXPECT_THAT(error(kAscii, "10 0 0 0 255", "1e999 0 0 0 255"),
              HasSubstr("vertex 2: a coordinate is not a finite"));
  EXPECT_THAT(error(kAscii, "10 0 0 0 255", "ten 0 0 0 255"), HasSubstr("vertex 2: \"ten\" is not a number"));
  EXPECT_THAT(error(kAscii, "3 0 1 3 6", "3 0 1 4 6"), HasSubstr("names vertex 5, but there are only 4"));
  EXPECT_THAT(error(kAscii, "3 0 1 3 6", "3 0 1 -3 6"), HasSubstr("face 2: \"-3\" is not the index"));
  EXPECT_THAT(error(kAscii, "3 0 1 3 6", "2 0 1 6"), HasSubstr("face 2: has 2 corners"));
  EXPECT_THAT(error(kAscii, "3 0 1 3 6", "99999 0 1 6"), HasSubstr("is more than the file holds"));
  EXPECT_THAT(error(kAscii, "element vertex 4", "element vertex 4000000000"), HasSubstr("is cut off"));
  EXPECT_THAT(error(kAscii, "element face 4", "element face 6"), HasSubstr("face 5: a list of 42 is more"));
  EXPECT_THAT(error(kAscii, "property double x", "property quad x"), HasSubstr("a.ply:6|unknown type"));
  EXPECT_THAT(error(kAscii, "format ascii", "format ebcdic"), HasSubstr("unknown format"));
  EXPECT_THAT(error(kAscii, "end_header\n", "end"), HasSubstr("header"));
  EXPECT_THAT(error(kAscii, "double x", "double w"), HasSubstr("no x, y and z"));
  const std::string binary = binary_ply(false);
  EXPECT_THAT(import_error(scratch.write("b.ply", binary.substr(0, binary.size() - 3))),
              HasSubstr("cut off"));
  EXPECT_THAT(import_error(scratch.write("c.ply",
                                         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                                         "property float y\nproperty float z\nend_header\n0 0 0\n")),
              HasSubstr("points but no faces"));
}

// Every prefix of a file is refused, or is a whole one.
TEST(ImportPly, NoPrefixIsHalfAPart) {
  const Scratch scratch;
  const std::string binary = binary_ply(true);
  for (std::size_t size = 1; size < binary.size(); size += 7)
    EXPECT_NE(import_error(scratch.write("p.ply", binary.substr(0, size))), "") << size;
}

TEST(ImportPly, AnAttributeThatIsNotFiniteStaysInTheSourceOnly) {
  const Scratch scratch;
  std::string text = kAscii;
  text.replace(text.find("1.5\n"), 3, "nan");
  const Surface surface = import_surface(scratch.write("a.ply", text));
  EXPECT_EQ(surface.vertex_columns.count("quality"), 0u);
  EXPECT_EQ(surface.sources[0].bytes.size(), text.size());
}

TEST(ImportPly, TheRealGearboxKeepsItsColours) {
  SKIP_WITHOUT_PARTS();
  const Surface surface = import_surface(part_path("cycloidal.ply"));
  EXPECT_EQ(surface.vertices.size(), 21384u);
  EXPECT_EQ(surface.polygon_count(), 43368u);
  EXPECT_EQ(surface.vertex_columns.at("color").components, 4);
  EXPECT_EQ(surface.polygon_columns.at("color").components, 4);
  EXPECT_NEAR(bounding_box(surface.vertices).size().x(), 1.875e-3, 1e-6);
}

TEST(ImportOff, KeepsOrderPolygonsAndColours) {
  const Scratch scratch;
  const std::string text =
      "COFF # a pyramid\n5 5 0 # counts\n\n0 0 0 255 0 0\n2 0 0 0 255 0\n# between\n2 2 0 0 0 255\n0 2 0 51 "
      "51 51\n"
      "1 1 1.5 0 0 0\n4 3 2 1 0 255 0 51\n3 0 1 4\n3 1 2 4 0 0 0\n3 2 3 4\n3 3 0 4 # last";
  const Surface surface = import_surface(scratch.write("a.off", text));
  EXPECT_EQ(surface.polygon_offsets, (std::vector<std::uint32_t>{0, 4, 7, 10, 13, 16}));
  EXPECT_EQ(surface.vertices[4], Vec3(1, 1, 1.5) * 1e-3);
  EXPECT_EQ(surface.vertex_columns.at("color").values[4], 1.0);
  EXPECT_EQ(surface.polygon_columns.at("color").values,
            (std::vector<double>{1, 0, 0.2, 1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1, 1}));
  EXPECT_TRUE(shape(surface).topology.closed());
  EXPECT_NEAR(shape(surface).volume, 2e-9, 1e-20);
}

TEST(ImportOff, NumbersMayBeAnywhereOnTheLines) {
  const Scratch scratch;
  const Surface surface = import_surface(
      scratch.write("a.off", "OFF 4 4 6\n0 0 0 1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3\n1 2 3\n3 2 0 3\n"));
  EXPECT_EQ(surface.vertices[3], Vec3(0, 0, 1) * 1e-3);
  EXPECT_TRUE(shape(surface).topology.closed());
}

TEST(ImportOff, DamageIsNamed) {
  const Scratch scratch;
  const auto error = [&](const std::string& text) { return import_error(scratch.write("a.off", text)); };
  const std::string corners = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  EXPECT_THAT(error(corners + "3 0 2 1\n3 0 1 3\n3 1 2 3\n"), HasSubstr("cut off"));
  EXPECT_THAT(error(corners + "3 0 2 1\n3 0 1 3\n3 1 2 4\n3 2 0 3\n"),
              HasSubstr("a.off:9|a face names vertex 4"));
  EXPECT_THAT(error(corners + "3 0 2 1\n3 0 1 3\n2 1 2\n3 2 0 3\n"),
              HasSubstr("a.off:9|a face has 2 corners"));
  EXPECT_THAT(error("OFF\n4 4 0\n0 0 0\n1 nan 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"),
              HasSubstr("vertex 2|\"nan\" is not a finite number"));
  EXPECT_THAT(error("OFF\n4000000000 4 0\n0 0 0\n"), HasSubstr("is cut off"));
  EXPECT_THAT(error("OFF BINARY\n"), HasSubstr("binary OFF is not read"));
  EXPECT_THAT(error("4OFF\n1 1 1\n"), HasSubstr("another dimension"));
  EXPECT_THAT(error("OFF\n1 0 0\n0 0 0\n"), HasSubstr("no faces"));
}

TEST(ImportOff, TheRealBall) {
  SKIP_WITHOUT_PARTS();
  const Surface ball = import_surface(part_path("ballA.off"));
  EXPECT_EQ(ball.vertices.size(), 1900u);
  EXPECT_EQ(ball.polygon_count(), 3796u);
  EXPECT_TRUE(shape(ball).topology.closed());
  EXPECT_NEAR(bounding_box(ball.vertices).size().z(), 13.85e-3, 1e-5);
  EXPECT_EQ(ball.vertices[0], Vec3(-0.25829 * 1e-3, -4.29578 * 1e-3, 4.02524 * 1e-3));
}

}  // namespace
}  // namespace flexel::test
