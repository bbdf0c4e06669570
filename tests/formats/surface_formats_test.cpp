// PLY, OFF and GLB that come out: the file that came in with other positions, or a new one.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <numbers>
#include <tuple>

#include "formats/exchange/resolution.h"
#include "formats/exchange/size_warning.h"
#include "formats/exchange/surface_file.h"
#include "tests/formats/import_help.h"
#include "tests/formats/make_files.h"

namespace flexel::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A quarter turn about z and a shift, with something of a bend, in metres.
std::vector<Vec3> bend(const Surface& surface) {
  std::vector<Vec3> displacement;
  for (const Vec3& v : surface.vertices)
    displacement.push_back(Vec3(-v.y() + 0.2 * v.z(), v.x(), v.z() + 3 * v.x() * v.x()) - v);
  return displacement;
}

std::string written_as(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                       const Scratch& scratch, const std::string& name) {
  write_surface(surface, displacement, format, default_unit(surface), scratch.path(name));
  return read_file(scratch.path(name));
}

void expect_moved(const Surface& before, const std::vector<Vec3>& displacement, const Surface& after,
                  double tolerance) {
  ASSERT_EQ(before.vertices.size(), after.vertices.size());
  for (std::size_t v = 0; v < before.vertices.size(); ++v)
    EXPECT_NEAR((before.vertices[v] + displacement[v] - after.vertices[v]).norm(), 0, tolerance) << v;
  EXPECT_EQ(before.polygon_offsets, after.polygon_offsets);
  EXPECT_EQ(before.polygon_vertices, after.polygon_vertices);
}

constexpr const char* kPly =
    "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 4\r\nproperty uchar red\r\n"
    "property double x\r\nproperty double y\r\nproperty double z\r\nproperty uchar green\r\n"
    "property uchar blue\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\nelement face 4\r\n"
    "property list uchar int vertex_indices\r\nproperty float heat\r\nend_header\r\n"
    "255 0 0 0.000 7 9 0 0 1\r\n 0 1.50 0 0 7 9 1 0 0\r\n0 0 1 0 7 9 0 1 0\r\n0 0 0 1 7 9 0.0 0 1\r\n"
    "3 0 2 1 0.5\r\n3 0 1 3 1.5\r\n3 1 2 3 2\r\n3 2 0 3 1e-3\r\n";

TEST(WritePly, FromPlyEverythingButPositionsAndNormalsStays) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.ply", kPly));
  EXPECT_EQ(written_as(surface, nothing(surface), surface_format("ply"), scratch, "b.ply"), kPly);
  std::vector<Vec3> motion = nothing(surface);
  motion[1] = Vec3(0, 0.25e-3, 0);
  const std::string text = written_as(surface, motion, surface_format("ply"), scratch, "c.ply");
  EXPECT_THAT(text, StartsWith(std::string(kPly).substr(0, std::string(kPly).find("end_header"))));
  EXPECT_THAT(text, HasSubstr("\r\n 0 1.50 0.25 0 7 9 "));
  EXPECT_THAT(text, HasSubstr("\r\n255 0 0 0.000 7 9 "));
  EXPECT_THAT(text, ::testing::EndsWith("\r\n3 0 2 1 0.5\r\n3 0 1 3 1.5\r\n3 1 2 3 2\r\n3 2 0 3 1e-3\r\n"));
  expect_moved(surface, motion, import_surface(scratch.path("c.ply")), 1e-18);
}

TEST(WritePly, NormalsTurnWithTheSurface) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.ply", kPly));
  std::vector<Vec3> motion;
  for (const Vec3& v : surface.vertices) motion.push_back(Vec3(-v.y(), v.x(), v.z()) - v);
  const std::string text = written_as(surface, motion, surface_format("ply"), scratch, "b.ply");
  // The second vertex's normal, x, is now y.
  const std::string line = text.substr(text.find("\r\n 0 ") + 2);
  double red, x, y, z, green, blue, nx, ny, nz;
  ASSERT_EQ(std::sscanf(line.c_str(), "%lf %lf %lf %lf %lf %lf %lf %lf %lf", &red, &x, &y, &z, &green, &blue,
                        &nx, &ny, &nz),
            9);
  EXPECT_NEAR(Vec3(nx, ny, nz).norm(), 1, 1e-6);
  // The smallest rotation of this vertex's area vector, not of the body's motion, turns it.
  EXPECT_GT(ny, 0.5);
}

TEST(WritePly, BinaryKeepsTypesAndByteOrder) {
  const Scratch scratch;
  for (const bool big : {false, true}) {
    std::string data =
        std::string("ply\nformat binary_") + (big ? "big" : "little") +
        "_endian 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n"
        "property int id\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
    const auto add = [&](auto value) {
      std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
      if (big) std::reverse(bytes.begin(), bytes.end());
      data += bytes;
    };
    for (const auto& p : {Vec3(0, 0, 0), Vec3(1, 0.1, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}) {
      add(static_cast<float>(p.x()));
      add(p.y());
      add(static_cast<float>(p.z()));
      add(std::int32_t{-5});
    }
    for (const auto& t : {std::array<std::int32_t, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
      add(std::uint8_t{3});
      for (const std::int32_t v : t) add(v);
    }
    const Surface surface = import_surface(scratch.write("a.ply", data));
    EXPECT_EQ(written_as(surface, nothing(surface), surface_format("ply"), scratch, "b.ply"), data);
    const std::string moved = written_as(surface, bend(surface), surface_format("ply"), scratch, "c.ply");
    EXPECT_EQ(moved.size(), data.size());
    const Surface after = import_surface(scratch.path("c.ply"));
    expect_moved(surface, bend(surface), after, 1e-10);
    EXPECT_EQ(after.vertex_columns.at("id").values, std::vector<double>(4, -5.0));
  }
}

// A surface of two parts with colours and numbers, from OFF files.
Surface two_parts(const Scratch& scratch) {
  const std::string text =
      "COFF\n4 4 0\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 51 51 51\n3 0 2 1 255 0 0\n3 0 1 3\n"
      "3 1 2 3\n3 2 0 3\n";
  Surface surface = import_surface(scratch.write("one.off", text));
  append(surface, import_surface(scratch.write("two.off", text)));
  surface.vertex_columns["heat"] = {1, {1, 2, 3, 4, 5, 6, 7, 8.5}};
  surface.vertex_columns["flow"] = {3, std::vector<double>(24, 0.25)};
  return surface;
}

TEST(WritePly, ANewFileHasColoursNumbersPartsAndFaces) {
  const Scratch scratch;
  const Surface surface = two_parts(scratch);
  for (const SurfaceFormat format : {surface_format("ply"), surface_format("ply", "", true)}) {
    const std::string text = written_as(surface, bend(surface), format, scratch, "n.ply");
    EXPECT_THAT(text, HasSubstr("comment part 1 is two\n"));
    const Surface again = import_surface(scratch.path("n.ply"));
    expect_moved(surface, bend(surface), again, 1e-18);
    EXPECT_EQ(again.vertex_columns.at("color").values, surface.vertex_columns.at("color").values);
    EXPECT_EQ(again.polygon_columns.at("color").values, surface.polygon_columns.at("color").values);
    EXPECT_EQ(again.vertex_columns.at("heat").values, surface.vertex_columns.at("heat").values);
    EXPECT_EQ(again.vertex_columns.at("flow_y").values, std::vector<double>(8, 0.25));
    EXPECT_THAT(again.polygon_columns.at("part").values, ElementsAre(0, 0, 0, 0, 1, 1, 1, 1));
    EXPECT_EQ(again.polygon_columns.count("face"), 0u);  // these faces did not come with the file
  }
}

TEST(WriteOff, FromOffEverythingButPositionsAndNormalsStays) {
  const Scratch scratch;
  const std::string text =
      "NOFF # a tetrahedron\n4 4\n0 0 0.0 0 0 1\n1.00 0 0 1 0 0\n0 1 0 0 1 0\n0 0 1 0 0 1\n\n3 0 2 1 7\n"
      "3 0 1 3 0.5 0.5 0.5 # grey\n3 1 2 3\n3 2 0 3";
  const Surface surface = import_surface(scratch.write("a.off", text));
  EXPECT_EQ(written_as(surface, nothing(surface), surface_format("off"), scratch, "b.off"), text);
  std::vector<Vec3> shift(4, Vec3(0, 0, 1e-3));
  const std::string moved = written_as(surface, shift, surface_format("off"), scratch, "c.off");
  EXPECT_EQ(moved,
            "NOFF # a tetrahedron\n4 4\n0 0 1 0 0 1\n1.00 0 1 1 0 0\n0 1 1 0 1 0\n0 0 2 0 0 1\n\n3 0 2 1 7\n"
            "3 0 1 3 0.5 0.5 0.5 # grey\n3 1 2 3\n3 2 0 3");
  static_cast<void>(written_as(surface, bend(surface), surface_format("off"), scratch, "d.off"));
  expect_moved(surface, bend(surface), import_surface(scratch.path("d.off")), 1e-18);
}

TEST(WriteOff, ANewFileHasColours) {
  const Scratch scratch;
  const Surface surface = two_parts(scratch);
  EXPECT_THAT(written_as(surface, bend(surface), surface_format("off"), scratch, "n.off"),
              StartsWith("COFF\n"));
  const Surface again = import_surface(scratch.path("n.off"));
  expect_moved(surface, bend(surface), again, 1e-18);
  EXPECT_EQ(again.vertex_columns.at("color").values, surface.vertex_columns.at("color").values);
  EXPECT_EQ(again.polygon_columns.at("color").values, surface.polygon_columns.at("color").values);
}

TEST(WriteGlb, ANewFileHasPartsColoursAndNumbers) {
  const Scratch scratch;
  Surface surface = two_parts(scratch);
  static_cast<void>(written_as(surface, bend(surface), surface_format("glb"), scratch, "n.glb"));
  const Surface again = import_surface(scratch.path("n.glb"));
  ASSERT_EQ(again.parts.size(), 2u);
  EXPECT_EQ(again.parts[1].name, "two");
  EXPECT_EQ(again.sources[0].unit, 1.0);  // GLB is in metres
  const std::vector<Vec3> motion = bend(surface);
  for (std::size_t v = 0; v < 8; ++v)
    EXPECT_NEAR((surface.vertices[v] + motion[v] - again.vertices[v]).norm(), 0, 1e-9);
  EXPECT_EQ(again.vertex_columns.at("heat").values, surface.vertex_columns.at("heat").values);
  EXPECT_EQ(again.vertex_columns.at("flow").components, 3);
  for (std::size_t i = 0; i < 24; ++i)
    EXPECT_NEAR(again.vertex_columns.at("color").values[i], surface.vertex_columns.at("color").values[i],
                1e-6);
  // One triangle of each part is red: it is the first of its part's two primitives.
  EXPECT_NEAR(again.polygon_columns.at("color").values[1], 0, 1e-12);
  EXPECT_NEAR(again.polygon_columns.at("color").values[5], 1, 1e-12);
}

// A tetrahedron with normals, shown by two nodes, one of them turned and scaled.
std::string instanced() {
  std::vector<float> numbers = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int v = 0; v < 4; ++v) numbers.insert(numbers.end(), {0, 0, 1});
  return glb(
      R"({"asset":{"version":"2.0","generator":"hand"},"nodes":[{"mesh":0,"name":"a"},
{"mesh":0,"name":"b","rotation":[0,0,0.70710678118654757,0.70710678118654757],"scale":[2,1,3],"translation":[4,0,0]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2}],"extras":{"mark":1}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":0,"byteOffset":48,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5125,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":48}],
"buffers":[{"byteLength":144}]})",
      bytes_of(numbers) + bytes_of(std::vector<std::uint32_t>{0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}));
}

TEST(WriteGlb, FromGlbInstancesGetMeshesOfTheirOwn) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.glb", instanced()));
  EXPECT_EQ(written_as(surface, nothing(surface), surface_format("glb"), scratch, "b.glb"), instanced());
  const std::string text = written_as(surface, bend(surface), surface_format("glb"), scratch, "c.glb");
  EXPECT_THAT(text, HasSubstr("\"generator\":\"hand\""));
  EXPECT_THAT(text, HasSubstr("\"translation\":[4,0,0]"));
  const Surface after = import_surface(scratch.path("c.glb"));
  expect_moved(surface, bend(surface), after, 2e-5);  // single precision of lengths near 50
  EXPECT_EQ(after.parts[1].name, "b");
  // Only the second instance moves: the first keeps the mesh that it had.
  std::vector<Vec3> second = nothing(surface);
  for (std::size_t v = 4; v < 8; ++v) second[v] = Vec3(0, 0, 0.5);
  const std::string partly = written_as(surface, second, surface_format("glb"), scratch, "d.glb");
  EXPECT_THAT(partly, HasSubstr(R"({"mesh":0,"name":"a"})"));
  expect_moved(surface, second, import_surface(scratch.path("d.glb")), 1e-6);
}

TEST(WriteGlb, AMeshOfOneNodeIsOverwrittenInPlace) {
  const Scratch scratch;
  std::string one = instanced();
  one.replace(one.find("{\"mesh\":0,\"name\":\"a\"}"), 21, std::string("{}") + std::string(19, ' '));
  const Surface surface = import_surface(scratch.write("a.glb", one));
  ASSERT_EQ(surface.parts.size(), 1u);
  const std::string moved = written_as(surface, bend(surface), surface_format("glb"), scratch, "b.glb");
  EXPECT_EQ(moved.size() - moved.find("BIN"), one.size() - one.find("BIN"));
  expect_moved(surface, bend(surface), import_surface(scratch.path("b.glb")), 2e-5);
}

TEST(WriteSurface, RealFilesComeOutAsTheyWentIn) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  for (const auto& [file, format] : {std::pair{"cycloidal.ply", surface_format("ply")},
                                     {"ballA.off", surface_format("off")},
                                     {"pins.glb", surface_format("glb")}}) {
    const Surface surface = import_surface(part_path(file));
    EXPECT_EQ(written_as(surface, nothing(surface), format, scratch, file), read_file(part_path(file)))
        << file;
    write_surface(surface, bend(surface), format, default_unit(surface), scratch.path(file));
    const Surface after = import_surface(scratch.path(file));
    expect_moved(surface, bend(surface), after, 2e-7 * bounding_box(after.vertices).size().norm());
    EXPECT_EQ(after.vertex_columns.size(), surface.vertex_columns.size());
    EXPECT_EQ(after.parts.size(), surface.parts.size());
  }
}

TEST(WriteSurface, OneFileAPart) {
  const Scratch scratch;
  Surface surface = two_parts(scratch);
  surface.parts[1].name = "left/arm";
  write_surface(surface, bend(surface), surface_format("ply"), 1e-3, scratch.path("out_{part}.ply"));
  const Surface one = import_surface(scratch.path("out_one.ply")),
                two = import_surface(scratch.path("out_left_arm.ply"));
  EXPECT_EQ(one.vertices.size(), 4u);
  EXPECT_EQ(two.vertex_columns.at("heat").values, (std::vector<double>{5, 6, 7, 8.5}));
  EXPECT_EQ(two.polygon_vertices, one.polygon_vertices);
  const std::vector<Vec3> motion = bend(surface);
  for (std::size_t v = 0; v < 4; ++v)
    EXPECT_NEAR((surface.vertices[4 + v] + motion[4 + v] - two.vertices[v]).norm(), 0, 1e-18);
  EXPECT_FALSE(std::filesystem::exists(scratch.path("out_{part}.ply")));
}

TEST(WriteSurface, NamesThatDifferByASlashGetFilesOfTheirOwn) {
  const Scratch scratch;
  for (const bool slash_first : {true, false}) {
    Surface surface = two_parts(scratch);
    surface.parts[slash_first ? 0 : 1].name = "left/arm";
    surface.parts[slash_first ? 1 : 0].name = "left_arm";
    write_surface(surface, nothing(surface), surface_format("ply"), 1e-3, scratch.path("out_{part}.ply"));
    const auto first_of = [&](const std::string& file, std::size_t part) {
      const Surface own = import_surface(scratch.path(file));
      EXPECT_EQ(own.vertex_columns.at("heat").values.front(),
                surface.vertex_columns.at("heat").values[4 * part])
          << file;
    };
    first_of("out_left_arm.ply", slash_first ? 1 : 0);  // whose own name it is
    first_of("out_left_arm-2.ply", slash_first ? 0 : 1);
  }
}

TEST(SurfaceFormat, NewFormatsAreTold) {
  EXPECT_EQ(surface_format("", "a.ply", false), surface_format("ply"));
  EXPECT_EQ(surface_format("ply", "-", true), surface_format("ply", "", true));
  EXPECT_EQ(surface_format("", "a.OFF", false), surface_format("off"));
  EXPECT_EQ(surface_format("glb", "-", false), surface_format("glb"));
  EXPECT_THROW(static_cast<void>(surface_format("glb", "-", true)), InputError);
  EXPECT_THROW(static_cast<void>(surface_format("", "a.gltf", false)), InputError);
}

TEST(SizeWarning, NamesTheLikelyUnit) {
  const Scratch scratch;
  const std::string text =
      "OFF\n4 4 0\n0 0 0\n0.05 0 0\n0 0.04 0\n0 0 0.01\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
  Surface surface = import_surface(scratch.write("a.off", text));
  EXPECT_THAT(size_warnings(surface), ElementsAre(HasSubstr("likely --unit m")));
  ImportOptions options;
  options.unit = 1;
  EXPECT_TRUE(size_warnings(import_surface(scratch.path("a.off"), options)).empty());
  for (Vec3& v : surface.vertices) v *= 5e6;  // numbers of 250,000
  EXPECT_THAT(size_warnings(surface), ElementsAre(HasSubstr("likely --unit um")));
  surface.sources[0].format = "glb";
  surface.sources[0].unit = 1;
  EXPECT_THAT(size_warnings(surface),
              ElementsAre(HasSubstr("250 m across in m, the unit that it carries: its "
                                    "numbers are likely mm")));
}

// A stirrer of 0.6 mm, a car of 4.6 mm.
TEST(SizeWarning, PartsOfSomeMillimetresAreLikelyInMetresOrInches) {
  const Scratch scratch;
  const std::string text =
      "OFF\n4 4 0\n0 0 0\n4.6 0 0\n0 0.04 0\n0 0 0.01\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
  Surface surface = import_surface(scratch.write("car.off", text));
  EXPECT_THAT(size_warnings(surface),
              ElementsAre(HasSubstr(
                  "car.off is 4.6 mm long in mm, the unit for files that carry none: if the file is "
                  "in metres add --unit m (4.6 m), if in inches --unit in (117 mm)")));
  ImportOptions options;
  options.unit = 1e-3;
  EXPECT_TRUE(size_warnings(import_surface(scratch.path("car.off"), options)).empty()) << "the user knows";
  surface.sources[0].format = "step";
  EXPECT_TRUE(size_warnings(surface).empty()) << "the file carries its unit";
  surface.sources[0].format = "off";
  for (Vec3& v : surface.vertices) v *= 1.1;
  EXPECT_TRUE(size_warnings(surface).empty()) << "small parts are made";
}

TEST(Resolution, IsThatOfFloatsWhereTheFileHasThem) {
  const auto ply = [](const std::string& encoding, const std::string& type) {
    return "ply\nformat " + encoding + " 1.0\nelement vertex 3\nproperty " + type + " x\nproperty " + type +
           " y\nproperty " + type + " z\nelement face 1\nproperty list uchar int v\nend_header\n";
  };
  Surface surface;
  surface.vertices = {{1, 0, 0}, {0, -1000, 0}, {0, 0, 2}};
  surface.polygon_offsets = {0, 3};
  surface.polygon_vertices = {0, 1, 2};
  surface.polygon_face = {0};
  surface.faces.resize(1);
  surface.parts.resize(1);
  surface.part_source = {0};
  surface.sources.resize(1);  // in mm: the largest number is a million, of 20 bits before the point
  for (const auto& [format, header, resolution] :
       {std::tuple{"stl-binary", std::string(), 1e-3 / 16},
        {"stl-ascii", std::string(), 0.},
        {"ply-binary", ply("binary_little_endian", "float"), 1e-3 / 16},
        {"ply-binary", ply("binary_little_endian", "double"), 0.},
        {"ply-ascii", ply("ascii", "float"), 0.}}) {
    surface.sources[0].format = format;
    const std::string bytes = header + std::string(header.empty() ? 0 : 200, '\0');
    surface.sources[0].bytes.resize(bytes.size());
    std::transform(bytes.begin(), bytes.end(), surface.sources[0].bytes.begin(),
                   [](char c) { return static_cast<std::byte>(c); });
    EXPECT_DOUBLE_EQ(coordinate_resolution(surface, 0), resolution) << format << ' ' << header;
  }
}

TEST(SizeWarning, TheRealSensorIsInMetres) {
  SKIP_WITHOUT_PARTS();
  EXPECT_THAT(size_warnings(import_surface(part_path("ADIS16480.STL"))),
              ElementsAre(HasSubstr("likely --unit m")));
  EXPECT_TRUE(size_warnings(import_surface(part_path("hook.stl"))).empty());
}

}  // namespace
}  // namespace flexel::test
