#include <gmock/gmock.h>

#include <cstring>
#include <set>

#include "tests/formats/import_help.h"
#include "tests/formats/make_files.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;

// A tetrahedron: positions interleaved with normals, 8-bit indices.
std::string tetrahedron_buffer() {
  std::vector<float> vertices;
  for (const auto& p : {std::array<float, 3>{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
    vertices.insert(vertices.end(), p.begin(), p.end());
    vertices.insert(vertices.end(), {0, 0, 1});
  }
  return bytes_of(vertices) + bytes_of(std::vector<std::uint8_t>{0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
}

constexpr const char* kTables =
    R"("asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"meshes":[{"name":"tet","primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0}]}],
"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0.2140411,0,0.5]}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":0,"byteOffset":12,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":96,"byteStride":24},{"buffer":0,"byteOffset":96,"byteLength":12}],)";

// Two instances below a node that scales: one moved, one turned by 90 degrees about z and mirrored.
constexpr const char* kNodes =
    R"("nodes":[{"children":[1,2],"scale":[2,2,2]},{"mesh":0,"translation":[5,0,0],"name":"moved"},
{"mesh":0,"rotation":[0,0,0.70710678118654757,0.70710678118654757],"scale":[1,1,-1]}])";

std::string two_tetrahedra(const std::string& tables = kTables) {
  return glb("{" + tables + kNodes + R"(,"buffers":[{"byteLength":108}]})", tetrahedron_buffer());
}

TEST(ImportGltf, EveryInstanceIsAPartInTheWorld) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.glb", two_tetrahedra()));
  ASSERT_EQ(surface.parts.size(), 2u);
  EXPECT_EQ(surface.parts[0].name, "moved");
  EXPECT_EQ(surface.parts[1].name, "tet");
  EXPECT_EQ(surface.sources[0].unit, 1.0);
  EXPECT_TRUE(surface.sources[0].unit_given);
  EXPECT_EQ(surface.vertices[0], Vec3(10, 0, 0));
  EXPECT_EQ(surface.vertices[3], Vec3(10, 0, 2));
  EXPECT_NEAR((surface.vertices[5] - Vec3(0, 2, 0)).norm(), 0, 1e-15);
  EXPECT_NEAR((surface.vertices[7] - Vec3(0, 0, -2)).norm(), 0, 1e-15);
  // Mirroring turns triangles round, so both are outward.
  EXPECT_NEAR(shape(surface).volume, 2 * 8.0 / 6, 1e-12);
  const std::vector<double>& color = surface.polygon_columns.at("color").values;
  EXPECT_NEAR(color[0], 1, 1e-12);
  EXPECT_NEAR(color[1], 0.5, 1e-6);  // glTF's colours are linear
  EXPECT_EQ(color[3], 0.5);
}

TEST(ImportGltf, BuffersMayBeElsewhere) {
  const Scratch scratch;
  const Surface whole = import_surface(scratch.write("a.glb", two_tetrahedra()));
  static_cast<void>(scratch.write("a b.bin", tetrahedron_buffer()));
  const std::string text = std::string("{") + kTables + kNodes + R"(,"buffers":[{"byteLength":108,"uri":)";
  const Surface beside = import_surface(scratch.write("b.gltf", text + R"("a%20b.bin"}]})"));
  EXPECT_EQ(beside.vertices, whole.vertices);
  EXPECT_EQ(beside.polygon_vertices, whole.polygon_vertices);
  EXPECT_EQ(beside.sources[0].format, "glb");
  EXPECT_THAT(import_error(scratch.write("c.gltf", text + R"("none.bin"}]})")),
              HasSubstr("c.gltf|has its numbers in \"none.bin\", which is not there"));
  // 108 bytes of zeros, but for nothing: all its vertices are then at one point.
  const std::string zeros(144, 'A');
  EXPECT_THAT(import_error(scratch.write(
                  "d.gltf", text + "\"data:application/octet-stream;base64," + zeros + "\"}]})")),
              HasSubstr("d.gltf|"));
}

TEST(ImportGltf, StripsFansAndBareVerticesAreTriangles) {
  const Scratch scratch;
  const auto corners = [&](const std::string& change) {
    return import_surface(scratch.write("a.glb", two_tetrahedra(replaced(kTables, "\"indices\":2,", change))))
        .polygon_vertices;
  };
  EXPECT_EQ(corners("\"mode\":5,"), (std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2, 4, 6, 5, 5, 6, 7}));
  EXPECT_EQ(corners("\"mode\":6,"), (std::vector<std::uint32_t>{1, 2, 0, 2, 3, 0, 5, 4, 6, 6, 4, 7}));
}

TEST(ImportGltf, SeveralPrimitivesAreFaces) {
  const Scratch scratch;
  const std::string primitive = R"({"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0})";
  std::string tables = replaced(kTables, primitive, primitive + "," + primitive);
  tables = replaced(tables, R"({"pbrMetallic)", R"({"name":"red","pbrMetallic)");
  const Surface surface = import_surface(scratch.write("a.glb", two_tetrahedra(tables)));
  EXPECT_EQ(surface.vertices.size(), 8u);  // both primitives share their positions
  ASSERT_EQ(surface.faces.size(), 4u);
  EXPECT_EQ(surface.faces[1].name, "red");
}

TEST(ImportGltf, DamageIsNamed) {
  const Scratch scratch;
  const auto error = [&](const std::string& from, const std::string& to) {
    return import_error(scratch.write("a.glb", two_tetrahedra(replaced(kTables, from, to))));
  };
  EXPECT_THAT(error("\"count\":12", "\"count\":13"), HasSubstr("reaches beyond"));
  EXPECT_THAT(error("\"count\":4,", "\"count\":4e9,"), HasSubstr("reaches beyond"));
  EXPECT_THAT(error("\"byteLength\":96", "\"byteLength\":960"), HasSubstr("beyond the end of its buffer"));
  EXPECT_THAT(error("\"indices\":2", "\"indices\":-1"), HasSubstr("\"indices\" is not a whole number"));
  EXPECT_THAT(error("\"indices\":2", "\"indices\":7"), HasSubstr("\"accessors\" has no entry 7"));
  EXPECT_THAT(error("\"POSITION\":0", "\"POSITION\":2"), HasSubstr("a.glb|"));
  EXPECT_THAT(error("\"2.0\"", "\"1.0\""), HasSubstr("another version"));
  EXPECT_THAT(error("[{\"nodes\":[0]}]", "[{\"nodes\":[0,1]}]"), HasSubstr("hangs on two others"));
  EXPECT_THAT(error("\"scene\":0", "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]"),
              HasSubstr("draco"));
  const std::string good = two_tetrahedra();
  EXPECT_THAT(import_error(scratch.write("b.glb", good.substr(0, good.size() - 5))), HasSubstr("is cut off"));
  std::string flat = good;
  flat.replace(flat.find("[1,1,-1]"), 8, "[1,1,-0]");
  EXPECT_THAT(import_error(scratch.write("c.glb", flat)), HasSubstr("flattens"));
  std::string nan = good;
  const float not_a_number = std::nanf("");
  std::memcpy(&nan[good.find("BIN") + 4 + 24], &not_a_number, 4);
  EXPECT_THAT(import_error(scratch.write("d.glb", nan)), HasSubstr("vertex 2 of accessor 0"));
  ImportOptions options;
  options.unit = 1e-3;
  EXPECT_THAT(import_error(scratch.write("e.glb", good), options), HasSubstr("leave out --unit"));
}

TEST(ImportGltf, TheRealPinsAreSevenPartsInMillimetres) {
  SKIP_WITHOUT_PARTS();
  const Surface pins = import_surface(part_path("pins.glb"));
  ASSERT_EQ(pins.parts.size(), 7u);
  EXPECT_EQ(pins.vertices.size(), 1698u);
  EXPECT_EQ(pins.polygon_count(), 3408u);
  // Its meshes say "units": "mm" in their extras.
  EXPECT_NEAR((bounding_box(pins.vertices).size() - Vec3(0.254, 0.254, 0.0254)).norm(), 0, 1e-6);
  std::set<std::string> names;
  for (const SurfacePart& part : pins.parts) names.insert(part.name);
  EXPECT_EQ(names.size(), 7u);
  EXPECT_TRUE(shape(pins).topology.closed());
  // Every pin has the volume of the first, wherever its node puts it.
  const Shape whole = shape(pins);
  std::vector<std::vector<std::array<std::uint32_t, 3>>> corners(7);
  for (std::size_t t = 0; t < whole.triangles.corners.size(); ++t)
    corners[pins.polygon_part(whole.triangles.polygon[t])].push_back(whole.triangles.corners[t]);
  const double first = signed_volume(pins.vertices, corners[1]);
  EXPECT_GT(first, 0);
  for (std::size_t part = 2; part < 7; ++part)
    EXPECT_NEAR(signed_volume(pins.vertices, corners[part]) / first, 1, 1e-5);
}

// --- 3MF

std::string model(const std::string& unit, const std::string& resources, const std::string& build) {
  return "<?xml version=\"1.0\"?><model unit=\"" + unit + "\" xmlns:m=\"x\"><resources>" + resources +
         "</resources><build>" + build + "</build></model>";
}

const std::string kMesh =
    "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1.123456789012\" y=\"0\" z=\"0\"/>"
    "<vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"1\"/></vertices><triangles>"
    "<triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"1\" v3=\"3\" pid=\"9\" p1=\"1\"/>"
    "<triangle v1=\"1\" v2=\"2\" v3=\"3\"/><triangle v1=\"2\" v2=\"0\" v3=\"3\"/></triangles></mesh>";
const std::string kColors =
    "<m:colorgroup id=\"9\"><m:color color=\"#FF0000\"/><m:color color=\"#00FF0080\"/></m:colorgroup>";

TEST(Import3mf, ComponentsTransformsUnitsAndColours) {
  const Scratch scratch;
  const std::string resources =
      kColors + "<object id=\"1\" name=\"tet\" pid=\"9\" pindex=\"0\">" + kMesh +
      "</object><object id=\"2\"><components>"
      "<component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/>"
      "<component objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 0 0 0\"/></components></object>";
  const std::string build =
      "<item objectid=\"2\" transform=\"2 0 0 0 2 0 0 0 2 0 0 5\"/><item objectid=\"1\"/>";
  const Surface surface = import_surface(scratch.write("a.3mf", threemf(model("inch", resources, build))));
  ASSERT_EQ(surface.parts.size(), 3u);
  EXPECT_EQ(surface.parts[2].name, "tet-3");
  EXPECT_EQ(surface.sources[0].unit, 0.0254);
  EXPECT_EQ(surface.vertices[0], Vec3(20, 0, 5) * 0.0254);
  EXPECT_EQ(surface.vertices[5], Vec3(0, 2 * 1.123456789012, 5) * 0.0254);  // x goes to y
  EXPECT_EQ(surface.vertices[9].x(), 1.123456789012 * 0.0254);              // double precision
  EXPECT_EQ(surface.polygon_columns.at("color").values[0], 1);
  EXPECT_EQ(surface.polygon_columns.at("color").values[5], 1);
  EXPECT_EQ(surface.polygon_columns.at("color").values[7], 128 / 255.0);
  EXPECT_TRUE(shape(surface).topology.closed());
}

TEST(Import3mf, MeshesMayBeInOtherFilesOfTheArchive) {
  const Scratch scratch;
  const std::string root = model("millimeter",
                                 "<object id=\"4\"><components><component p:path=\"/3D/Objects/o.model\" "
                                 "objectid=\"1\"/></components></object>",
                                 "<item objectid=\"4\"/>");
  const std::string other = model("millimeter", "<object id=\"1\">" + kMesh + "</object>", "");
  const Surface surface = import_surface(
      scratch.write("a.3mf", zip({{"3D/3dmodel.model", root}, {"3D/Objects/o.model", other}})));
  EXPECT_EQ(surface.vertices.size(), 4u);
  EXPECT_EQ(surface.vertices[3].z(), 1e-3);
}

TEST(Import3mf, DamageIsNamed) {
  const Scratch scratch;
  const auto error = [&](const std::string& unit, const std::string& resources, const std::string& build) {
    return import_error(scratch.write("a.3mf", threemf(model(unit, resources, build))));
  };
  const std::string object = "<object id=\"1\">" + kMesh + "</object>", item = "<item objectid=\"1\"/>";
  EXPECT_EQ(error("millimeter", object, item), "");
  EXPECT_THAT(error("parsec", object, item), HasSubstr("unknown unit \"parsec\""));
  EXPECT_THAT(error("millimeter", object, "<item objectid=\"7\"/>"), HasSubstr("object \"7\" is not in it"));
  EXPECT_THAT(error("millimeter", object, ""), HasSubstr("builds no triangles"));
  EXPECT_THAT(error("millimeter", replaced(object, "x=\"1.123", "x=\"nan"), item), HasSubstr("vertex 2"));
  EXPECT_THAT(error("millimeter", replaced(object, "v2=\"1\" v3=\"3\"", "v2=\"1\" v3=\"4\""), item),
              HasSubstr("triangle 2 names vertex \"4\""));
  EXPECT_THAT(error("millimeter",
                    "<object id=\"1\"><components><component objectid=\"1\"/></components></object>", item),
              HasSubstr("contain one another"));
  const std::string good = threemf(model("millimeter", object, item));
  EXPECT_THAT(import_error(scratch.write("b.3mf", good.substr(0, good.size() / 2))),
              HasSubstr("damaged or cut off"));
  EXPECT_THAT(import_error(scratch.write("c.3mf", replaced(good, "x=\"1.1", "x=\"2.1"))),
              HasSubstr("does not unpack"));
  EXPECT_THAT(import_error(scratch.write("d.3mf", zip({{"a.txt", "a"}}))), HasSubstr("no 3MF file"));
  ImportOptions options;
  options.unit = 1e-3;
  EXPECT_THAT(import_error(scratch.write("e.3mf", good), options), HasSubstr("leave out --unit"));
}

// A required extension that is used must be understood, and matter that is no triangles is not left out.
TEST(Import3mf, WhatIsNotReadIsRefusedByName) {
  const Scratch scratch;
  const auto error = [&](const std::string& required, const std::string& in_object, const std::string& mesh) {
    std::string text = model("millimeter", "<object id=\"1\" name=\"foam\"" + in_object + mesh + "</object>",
                             "<item objectid=\"1\"/>");
    text = replaced(text, "xmlns:m=\"x\"",
                    "xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\" "
                    "xmlns:s=\"http://schemas.microsoft.com/3dmanufacturing/slice/2015/07\" "
                    "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" "
                    "xmlns:q=\"http://example.org/foam\" requiredextensions=\"" +
                        required + "\"");
    return import_error(scratch.write("a.3mf", threemf(text)));
  };
  EXPECT_EQ(error("p", " p:UUID=\"7\">", kMesh), "");
  EXPECT_EQ(error("p s", ">", kMesh), "");  // required, but this object does without
  EXPECT_THAT(error("p s", " s:slicestackid=\"2\">", kMesh),
              HasSubstr("object \"foam\" uses the extension \"slice\", which the file requires"));
  EXPECT_EQ(error("p", " s:slicestackid=\"2\">", kMesh), "");  // the triangles say the same
  EXPECT_THAT(error("q", ">", replaced(kMesh, "<mesh>", "<mesh><q:pores/>")),
              HasSubstr("the extension \"http://example.org/foam\""));
  const std::string beams =
      "<b:beamlattice><b:beams><b:beam v1=\"0\" v2=\"1\"/></b:beams></b:beamlattice></mesh>";
  for (const char* required : {"b", ""})
    EXPECT_THAT(error(required, ">", replaced(kMesh, "</mesh>", beams)),
                HasSubstr("object \"foam\" is a lattice of 1 beams"));
  EXPECT_THAT(error("", ">", "<q:foam/>"), HasSubstr("object \"foam\" has no triangles, only a \"foam\""));
  EXPECT_THAT(error("", ">", "<mesh><vertices/><triangles/></mesh>"),
              HasSubstr("object \"foam\" has no triangles"));
}

TEST(Import3mf, TheRealImplantsLatticeOfBeamsIsRefused) {
  SKIP_WITHOUT_PARTS();
  EXPECT_THAT(import_error(part_path("spinal_implant.3mf")),
              HasSubstr("object \"Thick_lattice\" is a lattice of 11821 beams"));
}

TEST(Import3mf, TheRealBlockIsInInches) {
  SKIP_WITHOUT_PARTS();
  const Surface block = import_surface(part_path("featuretype.3MF"));
  EXPECT_EQ(block.vertices.size(), 1092u);
  EXPECT_EQ(block.polygon_count(), 2208u);
  EXPECT_EQ(block.parts[0].name, "Cut-Extrude6");
  EXPECT_NEAR((bounding_box(block.vertices).size() - Vec3(127e-3, 63.5e-3, 34.925e-3)).norm(), 0, 1e-9);
  EXPECT_EQ(block.polygon_columns.at("color").values[1], 0xd1 / 255.0);
}

}  // namespace
}  // namespace flexel::test
