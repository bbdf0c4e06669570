// One bracket in every format and unit gives one body.
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/program/progress.h"
#include "tests/formats/import_help.h"
#include "tests/formats/make_files.h"
#include "tests/formats/occt_files.h"
#include "voxelize/voxelize.h"

namespace flexel::test {
namespace {

Body body_of(const std::string& path, const ImportOptions& options = {}) {
  Progress progress("test", Progress::Mode::quiet);
  voxelize::VoxelizeOptions voxels;
  voxels.size = 3e-3;
  return voxelize::voxelize(import_surface(path, options), voxels, progress).body;
}

void expect_same_body(const Body& a, const Body& b, const std::string& what) {
  constexpr double kRelative = 1e-6, kSize = 0.054;  // m, diagonal
  ASSERT_EQ(a.parts.size(), b.parts.size()) << what;
  ASSERT_EQ(a.element_count(), b.element_count()) << what;
  ASSERT_EQ(a.cell_elements, b.cell_elements) << what;
  EXPECT_EQ(a.lattice_index, b.lattice_index) << what;
  for (std::size_t p = 0; p < a.parts.size(); ++p)
    EXPECT_NEAR(a.parts[p].surface_volume / b.parts[p].surface_volume, 1, kRelative) << what;
  for (std::size_t e = 0; e < a.element_count(); ++e)
    ASSERT_NEAR((a.rest[e] - b.rest[e]).norm(), 0, kRelative * kSize) << what;
  for (std::size_t c = 0; c < a.cell_count(); ++c) ASSERT_NEAR(a.fill[c], b.fill[c], kRelative) << what;
}

// The bracket's triangles in mm as ASCII STL; with `twice`, another one 100 mm along y and turned by 180
// degrees about z.
std::string bracket_stl(bool twice) {
  std::string text;
  const Bracket part = bracket();
  for (int copy = 0; copy < (twice ? 2 : 1); ++copy) {
    text += "solid\n";
    for (const auto& t : bracket_triangles()) {
      text += "facet normal 0 0 0\nouter loop\n";
      for (const std::uint32_t v : t) {
        Vec3 at = part.vertices[v];
        if (copy == 1) at = Vec3(-at.x(), 100 - at.y(), at.z());
        text += fmt::format("vertex {} {} {}\n", at.x(), at.y(), at.z());
      }
      text += "endloop\nendfacet\n";
    }
    text += "endsolid\n";
  }
  return text;
}

std::string bracket_glb() {
  std::vector<float> positions;
  std::vector<std::uint16_t> indices;
  for (const Vec3& v : bracket().vertices)
    for (const double value : v) positions.push_back(static_cast<float>(value * 1e-3));
  for (const auto& t : bracket_triangles())
    for (const std::uint32_t v : t) indices.push_back(static_cast<std::uint16_t>(v));
  const std::string json = fmt::format(
      R"({{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}},{{"mesh":0,"translation":[0,0.1,0],"rotation":[0,0,1,0]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":12,"type":"VEC3"}},
{{"bufferView":1,"componentType":5123,"count":{0},"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":144}},{{"buffer":0,"byteOffset":144,"byteLength":{1}}}],
"buffers":[{{"byteLength":{2}}}]}})",
      indices.size(), 2 * indices.size(), 144 + 2 * indices.size());
  return glb(json, bytes_of(positions) + bytes_of(indices));
}

std::string bracket_3mf() {
  std::string mesh;
  for (const Vec3& v : bracket().vertices)
    mesh += fmt::format("<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", v.x() / 25.4, v.y() / 25.4, v.z() / 25.4);
  mesh = "<vertices>" + mesh + "</vertices><triangles>";
  for (const auto& t : bracket_triangles())
    mesh += fmt::format("<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"/>", t[0], t[1], t[2]);
  return threemf("<model unit=\"inch\"><resources><object id=\"1\"><mesh>" + mesh +
                 "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>");
}

// Polygons as they are, six corners and all.
std::string bracket_off(double scale) {
  const Bracket part = bracket();
  std::string text = fmt::format("OFF\n{} {} 0\n", part.vertices.size(), part.polygons.size());
  for (const Vec3& v : part.vertices)
    text += fmt::format("{} {} {}\n", v.x() * scale, v.y() * scale, v.z() * scale);
  for (const auto& polygon : part.polygons)
    text += fmt::format("{} {}\n", polygon.size(), fmt::join(polygon, " "));
  return text;
}

std::string bracket_ply() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 12\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 8\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string off = bracket_off(1);
  return text + off.substr(off.find('\n', 4) + 1);
}

TEST(SameBody, FromMeshFormatsInOtherUnits) {
  const Scratch scratch;
  const Body reference = body_of(scratch.write("a.stl", bracket_stl(false)));
  EXPECT_NEAR(reference.parts[0].surface_volume, 12e-6, 1e-12);
  expect_same_body(reference, body_of(scratch.write("a.3mf", bracket_3mf())), "3MF in inches");
  expect_same_body(reference, body_of(scratch.write("a.ply", bracket_ply())), "PLY");
  ImportOptions inch;
  inch.unit = 0.0254;
  expect_same_body(reference, body_of(scratch.write("a.off", bracket_off(1 / 25.4)), inch), "OFF in inches");
}

TEST(SameBody, FromGlbWithInstances) {
  const Scratch scratch;
  expect_same_body(body_of(scratch.write("a.stl", bracket_stl(true))),
                   body_of(scratch.write("a.glb", bracket_glb())), "GLB");
}

#ifdef FLEXEL_STEP

TEST(SameBody, FromCadFormats) {
  const Scratch scratch;
  const Body reference = body_of(scratch.write("a.stl", bracket_stl(false)));
  write_bracket_step(scratch.path("a.step"), "M");
  expect_same_body(reference, body_of(scratch.path("a.step")), "STEP in metres");
  for (const bool solid : {true, false}) {
    write_bracket_iges(scratch.path("a.iges"), solid, "INCH");
    expect_same_body(reference, body_of(scratch.path("a.iges")), "IGES in inches");
  }
  write_bracket_brep(scratch.path("a.brep"), true);
  expect_same_body(reference, body_of(scratch.path("a.brep")), "BREP");
}

#endif

}  // namespace
}  // namespace flexel::test
