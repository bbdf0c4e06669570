// 3MF that comes out: the archive that came in with other coordinates, split triangles in it, or a new one.
#include <gmock/gmock.h>

#include "formats/common/refine_files.h"
#include "formats/exchange/refined_file.h"
#include "formats/exchange/surface_file.h"
#include "formats/threemf/zip.h"
#include "tests/formats/import_help.h"
#include "tests/formats/make_files.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::vector<Vec3> turned_and_bent(const Surface& surface) {
  std::vector<Vec3> displacement;
  for (const Vec3& v : surface.vertices)
    displacement.push_back(Vec3(-v.y() + 0.2 * v.z(), v.x(), v.z() + 3 * v.x() * v.x()) - v);
  return displacement;
}

std::string written_3mf(const Surface& surface, const std::vector<Vec3>& displacement, const Scratch& scratch,
                        double unit = 0) {
  write_surface(surface, displacement, surface_format("3mf"), unit > 0 ? unit : default_unit(surface),
                scratch.path("out.3mf"));
  return read_file(scratch.path("out.3mf"));
}

std::string unpacked(const std::string& archive, const std::string& name) {
  ZipArchive zip({reinterpret_cast<const std::byte*>(archive.data()), archive.size()}, "archive");
  const auto entry = zip.find(name);
  if (!entry) return "(missing)";
  const Bytes bytes = zip.read(*entry);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void expect_at(const Surface& before, const std::vector<Vec3>& displacement, const Surface& after,
               double tolerance) {
  ASSERT_EQ(before.vertices.size(), after.vertices.size());
  for (std::size_t v = 0; v < before.vertices.size(); ++v)
    EXPECT_NEAR((before.vertices[v] + displacement[v] - after.vertices[v]).norm(), 0, tolerance) << v;
  EXPECT_EQ(before.polygon_vertices, after.polygon_vertices);
  EXPECT_EQ(before.polygon_columns.contains("color"), after.polygon_columns.contains("color"));
  if (before.polygon_columns.contains("color")) {
    EXPECT_EQ(before.polygon_columns.at("color").values, after.polygon_columns.at("color").values);
  }
  ASSERT_EQ(before.parts.size(), after.parts.size());
  for (std::size_t p = 0; p < before.parts.size(); ++p) EXPECT_EQ(before.parts[p].name, after.parts[p].name);
}

const std::string kTetVertices =
    "<vertices>\n<vertex x=\"0.0\" y=\"0\" z=\"0\"/>\n<vertex x=\"1.50\" y=\"0\" z=\"0\"/>\n"
    "<vertex x=\"0\" y=\"1\" z=\"0\"/>\n<vertex x=\"0\" y=\"0\" z=\"1\"/>\n</vertices>\n";
const std::string kTetTriangles =
    "<triangles>\n<triangle v1=\"0\" v2=\"2\" v3=\"1\"/>\n<triangle v1=\"0\" v2=\"1\" v3=\"3\" pid=\"9\" "
    "p1=\"1\"/>\n"
    "<triangle v1=\"1\" v2=\"2\" v3=\"3\" pid=\"9\" p1=\"0\" p2=\"1\" p3=\"1\"/>\n"
    "<triangle v1=\"2\" v2=\"0\" v3=\"3\"/>\n</triangles>\n";

// Two uses of a component object that shows a tetrahedron twice, and an object outside of the build that shows it too.
std::string assembly() {
  const std::string text =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- by hand -->\n<model unit=\"inch\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
      "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\" "
      "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">\n"
      "<metadata name=\"Title\">A &amp; B</metadata>\n<resources>\n<m:colorgroup id=\"9\"><m:color "
      "color=\"#FF0000\"/><m:color color=\"#00FF0080\"/></m:colorgroup>\n"
      "<object id=\"1\" name=\"tet\" partnumber=\"t-1\" pid=\"9\" pindex=\"0\" "
      "p:UUID=\"077b369d-c2d4-fbe0-94dd-201451c75dd9\">\n<mesh>\n" +
      kTetVertices + kTetTriangles +
      "</mesh>\n</object>\n<object id=\"2\" p:UUID=\"5518e92c-28cf-664c-76a7-077bd57ea586\">\n<components>\n"
      "<component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\" "
      "p:UUID=\"1aef169a-5d65-9ab3-a244-0ec9dee3a570\"/>\n"
      "<component objectid=\"1\" transform=\"0 1 0 1 0 0 0 0 1 0 5 0\" "
      "p:UUID=\"7dfbaf6d-9972-4ef9-4a73-ff484e66ea15\"/>\n</components>\n</object>\n"
      "<object id=\"3\" name=\"spare\"><components><component objectid=\"1\"/></components></object>\n"
      "</resources>\n<build>\n<item objectid=\"2\" transform=\"2 0 0 0 2 0 0 0 2 0 0 5\" "
      "partnumber=\"left\"/>\n"
      "<item objectid=\"2\"/>\n</build>\n</model>\n";
  return zip({{"_rels/.rels",
               "<Relationships><Relationship Target=\"/3D/3dmodel.model\" Id=\"r\" "
               "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"},
              {"Metadata/thumbnail.png", std::string("\x89PNG\0\1", 6)},
              {"3D/3dmodel.model", text}});
}

TEST(Write3mf, AnUnmovedPartIsTheSameFile) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.3mf", assembly()));
  ASSERT_EQ(surface.parts.size(), 4u);
  EXPECT_EQ(written_3mf(surface, nothing(surface), scratch), assembly());
}

TEST(Write3mf, EveryUseThatMovedGetsAnObjectOfItsOwn) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.3mf", assembly()));
  const std::string out = written_3mf(surface, turned_and_bent(surface), scratch);
  EXPECT_EQ(out, written_3mf(surface, turned_and_bent(surface), scratch));
  const Surface after = import_surface(scratch.path("out.3mf"));
  expect_at(surface, turned_and_bent(surface), after, 1e-13);
  EXPECT_EQ(after.sources[0].unit, 0.0254);
  EXPECT_EQ(unpacked(out, "Metadata/thumbnail.png"), std::string("\x89PNG\0\1", 6));
  const std::string text = unpacked(out, "3D/3dmodel.model");
  for (const char* kept :
       {"<!-- by hand -->", "<metadata name=\"Title\">A &amp; B</metadata>", "partnumber=\"t-1\"",
        "transform=\"0 1 0 1 0 0 0 0 1 0 5 0\"", "pid=\"9\" p1=\"0\" p2=\"1\" p3=\"1\"",
        "color=\"#00FF0080\"", "partnumber=\"left\"",
        "<object id=\"3\" name=\"spare\"><components><component objectid=\"1\"/>"})
    EXPECT_THAT(text, HasSubstr(kept));
  // The spare part shows the tetrahedron as it was.
  EXPECT_EQ(text.find("<vertex x=\"1.50\" y=\"0\" z=\"0\"/>"), text.find("<vertex x=\"1.50\""));
  EXPECT_THAT(text, HasSubstr("<object id=\"1\" name=\"tet\""));
  std::set<std::string> ids, uuids;
  for (std::size_t at = 0; (at = text.find("UUID=\"", at)) != std::string::npos; at += 6)
    EXPECT_TRUE(uuids.insert(text.substr(at + 6, 36)).second);
  for (std::size_t at = 0; (at = text.find(" id=\"", at)) != std::string::npos; at += 5)
    EXPECT_TRUE(ids.insert(text.substr(at + 5, text.find('"', at + 5) - at - 5)).second);
  EXPECT_EQ(ids.size(), 4u + 4 + 1);  // four tetrahedra and one more pair of them
}

TEST(Write3mf, WhatDoesNotMoveKeepsItsObjectAndDigits) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.3mf", assembly()));
  std::vector<Vec3> last = nothing(surface);
  last[13] = Vec3(0.0254, 0, 0);
  const std::string text = unpacked(written_3mf(surface, last, scratch), "3D/3dmodel.model");
  expect_at(surface, last, import_surface(scratch.path("out.3mf")), 1e-16);
  EXPECT_THAT(text, HasSubstr("<item objectid=\"2\" transform="));
  EXPECT_THAT(text, HasSubstr("<item objectid=\"10\"/>"));
  EXPECT_THAT(text, HasSubstr("<vertex x=\"1.50\" y=\"1\" z=\"0\"/>"));  // x of the build is its y
}

TEST(Write3mf, AFlatteningTransformIsRefused) {
  const Scratch scratch;
  const std::string flat = threemf("<model><resources><object id=\"1\"><mesh>" + kTetVertices +
                                   replaced(kTetTriangles, " pid=\"9\" p1=\"1\"", "") +
                                   "</mesh></object></resources><build><item objectid=\"1\" transform=\"1 0 "
                                   "0 0 1 0 0 0 0 0 0 0\"/></build></model>");
  const Surface surface = import_surface(scratch.write("a.3mf", flat));
  EXPECT_EQ(written_3mf(surface, nothing(surface), scratch), flat);
  EXPECT_THROW(static_cast<void>(written_3mf(surface, turned_and_bent(surface), scratch)), InputError);
}

TEST(Write3mf, SlicesOfAPartThatMovedGoAndAreTold) {
  const Scratch scratch;
  const std::string sliced = threemf(
      "<model xmlns:s=\"http://schemas.microsoft.com/3dmanufacturing/slice/2015/07\"><resources><object "
      "id=\"1\" "
      "name=\"tet\" s:slicestackid=\"7\"><mesh>" +
      kTetVertices + kTetTriangles +
      "</mesh></object></resources><build><item objectid=\"1\"/></build></model>");
  std::string told;
  ImportOptions options;
  options.warn = [&](const std::string& line) { told += line; };
  const Surface surface = import_surface(scratch.write("a.3mf", sliced), options);
  EXPECT_THAT(told, HasSubstr("\"tet\" has slices beside its triangles"));
  const std::string text =
      unpacked(written_3mf(surface, turned_and_bent(surface), scratch), "3D/3dmodel.model");
  EXPECT_THAT(text, Not(HasSubstr("slicestackid")));
}

TEST(Write3mf, DamagedBytesOfABodyAreRefused) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.3mf", assembly()));
  std::size_t refused = 0;
  const std::string good = written_3mf(surface, turned_and_bent(surface), scratch);
  for (std::size_t at = 0; at < surface.sources[0].bytes.size(); at += 7) {
    Surface damaged = surface;
    damaged.sources[0].bytes[at] ^= std::byte{0x15};
    try {
      const std::string same = written_3mf(damaged, turned_and_bent(surface), scratch);
      EXPECT_EQ(unpacked(same, "3D/3dmodel.model"), unpacked(good, "3D/3dmodel.model")) << at;
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 200u);
  Surface other = surface;
  const std::string small =
      threemf("<model><resources><object id=\"1\"><mesh>" + kTetVertices + kTetTriangles +
              "</mesh></object></resources><build><item objectid=\"1\"/></build></model>");
  other.sources[0].bytes.assign(reinterpret_cast<const std::byte*>(small.data()),
                                reinterpret_cast<const std::byte*>(small.data()) + small.size());
  EXPECT_THROW(static_cast<void>(written_3mf(other, turned_and_bent(surface), scratch)), InputError);
}

// --- new files

// A box of quads and a tetrahedron, with colours of polygons and vertices.
Surface colored_parts(const Scratch& scratch) {
  const std::string box =
      "COFF\n8 6 0\n0 0 0 255 255 255\n40 0 0 255 255 255\n40 10 0 255 255 255\n0 10 0 255 255 255\n"
      "0 0 5.1 255 0 0\n40 0 5.1 0 255 0\n40 10 5.1 0 0 255\n0 10 5.1 255 255 255\n4 0 3 2 1 255 0 0\n"
      "4 4 5 6 7\n4 0 1 5 4 0 0 255 128\n4 2 3 7 6\n4 1 2 6 5\n4 0 4 7 3\n";
  Surface surface = import_surface(scratch.write("box.off", box));
  append(surface, import_surface(scratch.write("tet.off",
                                               "OFF\n5 4 0\n9 9 9\n0 0 50\n1.1 0 50\n0 1 50\n0 0 51\n"
                                               "3 1 3 2\n3 1 2 4\n3 2 3 4\n3 3 1 4\n")));
  surface.parts[0].name = "a <\"box\"> & more\x01\xff";
  return surface;
}

TEST(WriteNew3mf, HasPartsColoursUnitAndTheSameDoubles) {
  const Scratch scratch;
  const Surface surface = colored_parts(scratch);
  for (const auto& [unit, written] : {std::pair{1e-3, 1e-3}, {0.0254, 0.0254}, {1.0, 1.0}, {1e3, 1e-3}}) {
    const std::string out = written_3mf(surface, turned_and_bent(surface), scratch, unit);
    EXPECT_EQ(out, written_3mf(surface, turned_and_bent(surface), scratch, unit));
    const Surface after = import_surface(scratch.path("out.3mf"));
    EXPECT_EQ(after.sources[0].unit, written);
    ASSERT_EQ(after.parts.size(), 2u);
    EXPECT_EQ(after.parts[0].name, "a <\"box\"> & more??");
    EXPECT_EQ(after.parts[1].name, "tet");
    const Triangles triangles = triangulate(surface);
    ASSERT_EQ(after.polygon_count(), triangles.corners.size());
    ASSERT_EQ(after.vertices.size(), 12u) << "one that nothing uses is left out";
    const std::vector<Vec3> motion = turned_and_bent(surface);
    for (std::size_t t = 0; t < triangles.corners.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t v = triangles.corners[t][i];
        EXPECT_EQ(after.vertices[after.polygon(t)[i]],
                  Vec3((surface.vertices[v] + motion[v]) / written) * written);
      }
    const std::vector<double>& colors = after.polygon_columns.at("color").values;
    EXPECT_EQ(std::vector<double>(colors.begin(), colors.begin() + 4), (std::vector<double>{1, 0, 0, 1}));
    EXPECT_EQ(colors[4 * 4 + 3], 128 / 255.0);
    EXPECT_EQ(colors[4 * 12], 1);  // the tetrahedron is white
  }
  const std::string text = unpacked(read_file(scratch.path("out.3mf")), "3D/3dmodel.model");
  EXPECT_THAT(text, HasSubstr("pid=\"1\" p1=\"0\" p2=\"1\" p3=\"2\""));  // corners of one triangle differ
}

TEST(WriteNew3mf, KeepsTheDigitsOfWhatDidNotMove) {
  const Scratch scratch;
  const Surface surface = colored_parts(scratch);
  const std::string text = unpacked(written_3mf(surface, nothing(surface), scratch), "3D/3dmodel.model");
  EXPECT_THAT(text, HasSubstr("<vertex x=\"40\" y=\"10\" z=\"5.1\"/>"));
}

// --- refinement

// Every triangle becomes two, at the middle of its first edge that has one.
Refinement halved(const Surface& surface) {
  Refinement result;
  result.vertices = static_cast<std::uint32_t>(surface.vertices.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
  // One edge of each tetrahedron: its two triangles are split.
  for (std::uint32_t p = 0; p < surface.polygon_count(); ++p) {
    const auto c = surface.polygon(p);
    std::size_t i = 0;
    while (i < 3 && !(c[i] % 4 + c[(i + 1) % 3] % 4 == 4 && c[i] % 4 != 2)) ++i;  // between vertices 1 and 3
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t d) {
      result.corners.insert(result.corners.end(), {a, b, d});
      result.offsets.push_back(static_cast<std::uint32_t>(result.corners.size()));
      result.origin.push_back(p);
    };
    if (i == 3) {
      add(c[0], c[1], c[2]);
      continue;
    }
    const std::uint32_t a = c[i], b = c[(i + 1) % 3], d = c[(i + 2) % 3];
    const auto [found, is_new] =
        middle.emplace(std::minmax(a, b), result.vertices + static_cast<std::uint32_t>(middle.size()));
    if (is_new) result.ends.push_back({std::min(a, b), std::max(a, b)});
    add(a, found->second, d);
    add(found->second, b, d);
  }
  return result;
}

TEST(Refine3mf, SplitsTrianglesWithTheirColours) {
  const Scratch scratch;
  const Surface surface = import_surface(scratch.write("a.3mf", assembly()));
  const std::vector<SurfaceFormat> formats = {surface_format("3mf")};
  const Surface split = refined_with_file(surface, halved(surface), formats);
  ASSERT_EQ(split.polygon_count(), 24u);
  const std::vector<Vec3> motion = turned_and_bent(split);
  const std::string text = unpacked(written_3mf(split, motion, scratch), "3D/3dmodel.model");
  // Half-way between #FF0000 and #00FF0080.
  EXPECT_THAT(text, HasSubstr("<m:color color=\"#808000C0\"/>"));
  EXPECT_THAT(text, HasSubstr("p1=\"0\" p2=\"1\" p3=\"2\""));
  const Surface after = import_surface(scratch.path("out.3mf"));
  ASSERT_EQ(after.vertices.size(), split.vertices.size());
  ASSERT_EQ(after.polygon_count(), 24u);
  for (std::size_t p = 0; p < 24; ++p)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = split.polygon(p)[i];
      EXPECT_NEAR((after.vertices[after.polygon(p)[i]] - split.vertices[v] - motion[v]).norm(), 0, 1e-13)
          << p;
    }
  EXPECT_EQ(after.polygon_columns.at("color").values[4], 0) << "a piece has its triangle's colour";
}

std::string refused_3mf(const Scratch& scratch, const std::string& triangles,
                        const std::string& resources = "", const std::string& in_mesh = "") {
  const std::string file = threemf(
      "<model unit=\"inch\"><resources>" + resources + "<object id=\"1\"><mesh>" + kTetVertices + triangles +
      in_mesh + "</mesh></object></resources><build><item objectid=\"1\"/></build></model>");
  const Surface surface = import_surface(scratch.write("a.3mf", file));
  SurfaceSource source = surface.sources[0];
  const std::string held = refine_3mf(source, halved(surface));
  EXPECT_EQ(held.empty(), source.bytes != surface.sources[0].bytes);
  const std::string out(reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size());
  return held.empty() ? unpacked(out, "3D/3dmodel.model") : held;
}

TEST(Refine3mf, TextureCoordinatesLieHalfWayAndSetsKeepTheirTriangles) {
  const Scratch scratch;
  const std::string text = refused_3mf(
      scratch, kTetTriangles,
      "<m:texture2dgroup id=\"9\" texid=\"8\"><m:tex2coord u=\"0.5\" v=\"0\"/><m:tex2coord u=\"1\" "
      "v=\"0.25\"/></m:texture2dgroup>",
      "<t:trianglesets><t:triangleset name=\"a\"><t:ref index=\"1\"/><t:ref index=\"3\"/>"
      "<t:refrange startindex=\"0\" endindex=\"2\"/></t:triangleset></t:trianglesets>");
  EXPECT_THAT(text, HasSubstr("<m:tex2coord u=\"0.75\" v=\"0.125\"/>"));
  EXPECT_THAT(text, HasSubstr("<t:refrange startindex=\"1\" endindex=\"2\"/><t:ref index=\"5\"/>"
                              "<t:refrange startindex=\"0\" endindex=\"4\"/>"));
}

TEST(Refine3mf, WhatCannotBeSplitIsNamed) {
  const Scratch scratch;
  EXPECT_EQ(refused_3mf(scratch, replaced(kTetTriangles, "p1=\"1\"/>", "p1=\"1\" paint_color=\"4\"/>")),
            "triangles with \"paint_color\"");
  EXPECT_EQ(refused_3mf(scratch, kTetTriangles,
                        "<basematerials id=\"9\"><base name=\"a\"/><base name=\"b\"/></basematerials>"),
            "triangles whose corners differ in their \"basematerials\"");
  EXPECT_EQ(refused_3mf(scratch, kTetTriangles), "triangles with the properties \"9\", which are not there");
  EXPECT_EQ(
      refused_3mf(scratch, kTetTriangles, "<m:colorgroup id=\"9\"><m:color color=\"#12\"/></m:colorgroup>"),
      "the colour \"#12\"");
  EXPECT_EQ(refused_3mf(scratch, kTetTriangles, "", "<x:skin/>"), "the element \"skin\" in a mesh");
}

// --- real files

TEST(Write3mf, RealFilesComeOutAsTheyWentIn) {
  SKIP_WITHOUT_PARTS();
  const Scratch scratch;
  for (const char* file : {"featuretype.3MF", "cube_gears_prod_req.3mf"}) {
    const Surface surface = import_surface(part_path(file));
    const std::string source = read_file(part_path(file));
    EXPECT_EQ(written_3mf(surface, nothing(surface), scratch), source) << file;
    const std::string moved = written_3mf(surface, turned_and_bent(surface), scratch);
    expect_at(surface, turned_and_bent(surface), import_surface(scratch.path("out.3mf")), 1e-15);
    EXPECT_EQ(unpacked(moved, "Metadata/thumbnail.png"), unpacked(source, "Metadata/thumbnail.png"));
    EXPECT_EQ(unpacked(moved, "[Content_Types].xml"), unpacked(source, "[Content_Types].xml"));
  }
}

// --- archives

TEST(Zip, ReadsWhatItWroteAndCopiesEntriesAsTheyArePacked) {
  ZipWriter writer;
  std::string text;
  for (int i = 0; i < 30000; ++i) text += std::to_string(i * 7919 % 1000);
  writer.add("a.txt", text);
  writer.add("empty", "");
  const Bytes first = writer.finish();
  ZipArchive archive(first, "first");
  ZipWriter again;
  again.copy(archive, 0);
  again.replace(archive, 1, "no more");
  const Bytes second = again.finish();
  ZipArchive copied(second, "second");
  const Bytes a = copied.read(copied.find("A.TXT").value()), b = copied.read(1);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(a.data()), a.size()), text);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(b.data()), b.size()), "no more");
  EXPECT_LT(first.size(), text.size());
}

}  // namespace
}  // namespace flexel::test
