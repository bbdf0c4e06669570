// What is drawn of parts, and that no text of a file becomes part of the page.
#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "base/error.h"
#include "flexel/view/page.h"
#include "flexel/view/page_files.h"
#include "flexel/view/shape.h"

namespace flexel::view {
namespace {

// A tube of `sides` quads with two lids: faces 0 (round), 1 and 2.
Surface tube(std::uint32_t sides, const std::string& name = "tube") {
  Surface surface;
  surface.polygon_offsets = {0};
  const auto add = [&](const std::vector<std::uint32_t>& corners, std::uint32_t face) {
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), corners.begin(), corners.end());
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    surface.polygon_face.push_back(face);
  };
  std::vector<std::uint32_t> bottom, top;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    for (const double z : {0.0, 0.03})
      surface.vertices.emplace_back(0.01 * std::cos(angle), 0.01 * std::sin(angle), z);
    const std::uint32_t next = (i + 1) % sides;
    add({2 * i, 2 * next, 2 * next + 1, 2 * i + 1}, 0);
    bottom.insert(bottom.begin(), 2 * i);
    top.push_back(2 * i + 1);
  }
  add(bottom, 1);
  add(top, 2);
  surface.faces = {{"", 0}, {"", 0}, {"", 0}};
  surface.parts = {{name}};
  surface.sources = {{}};
  surface.part_source = {0};
  return surface;
}

ViewFile shown(const Surface& surface, const std::string& label = "tube.stl") {
  ViewSubject subject;
  subject.label = subject.where = label;
  subject.surface = surface;
  Progress silent("test", Progress::Mode::silent);
  return make_view_file(subject, {}, silent);
}

TEST(Shape, PointsAreSharedWhereItIsSmooth) {
  const Shape round = surface_shape(tube(48), false);  // 7.5 degrees a side
  EXPECT_EQ(round.rest.size(), 2 * 2 * 48U);           // a ring of the side and one of the lid, at both ends
  EXPECT_EQ(round.creases.size(), 2 * 48U);
  EXPECT_EQ(round.triangles.size(), 2 * 48U + 2 * 46U);
  const Shape edged = surface_shape(tube(6), false);  // 60 degrees: each vertex has three normals
  EXPECT_EQ(edged.rest.size(), 3 * 12U);
  EXPECT_EQ(edged.creases.size(), 18U);
}

TEST(Shape, TrianglesLieWhereThoseOfTheSurfaceDo) {
  const Surface surface = tube(20);
  for (const bool by_polygon : {false, true}) {
    const Shape shape = surface_shape(surface, by_polygon);
    const Triangles triangles = triangulate(surface);
    ASSERT_EQ(shape.triangles.size(), triangles.corners.size());
    for (std::size_t t = 0; t < shape.triangles.size(); ++t) {
      EXPECT_EQ(shape.face[t], surface.polygon_face[triangles.polygon[t]]);
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t point = shape.triangles[t][i];
        EXPECT_EQ(shape.rest[point], surface.vertices[triangles.corners[t][i]]);
        EXPECT_EQ(shape.rest[point], surface.vertices[shape.source[point]]);
        EXPECT_TRUE(!by_polygon || shape.owner[point] == triangles.polygon[t]);
      }
    }
    EXPECT_TRUE(!by_polygon || shape.rest.size() == 3 * shape.triangles.size());
  }
}

TEST(Shape, ValuesOfPolygonsAreNotShared) {
  Surface surface = tube(24);
  Column& column = surface.polygon_columns["quality"];
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) column.values.push_back(static_cast<double>(p));
  const ViewFile file = shown(surface);
  ASSERT_EQ(file.surface->fields.size(), 1U);
  const Shape& shape = file.surface->shape;
  const std::vector<double>& values = file.surface->fields[0].values[0];
  const Triangles triangles = triangulate(surface);
  for (std::size_t t = 0; t < shape.triangles.size(); ++t)
    for (const std::uint32_t point : shape.triangles[t])
      EXPECT_EQ(values[point], static_cast<double>(triangles.polygon[t]));
  // Normals are still shared by what is smooth.
  EXPECT_EQ(std::set<std::uint32_t>(shape.smooth.begin(), shape.smooth.end()).size(), 2 * 2 * 24U);
}

TEST(Page, TextOfFilesIsNoPartOfIt) {
  const std::string evil = "</script><script>alert(1)</script><!--<img src=x onerror=alert(2)>";
  Surface surface = tube(6, evil);
  surface.faces[1].name = evil;
  PageOptions options;
  options.words = {{evil}, {evil}, R"({"warnings":[")" + evil + R"("],"x":")" + evil + "\"}"};
  const std::vector<ViewFile> files{shown(surface, evil)}, plain{shown(tube(6))};
  for (const bool whole : {false, true}) {
    const std::string page = make_page(files, options, whole).html, usual = make_page(plain, {}, whole).html;
    EXPECT_EQ(page.find("<script>alert"), std::string::npos);
    EXPECT_EQ(page.find("<img"), std::string::npos);
    const auto count = [](const std::string& text, const std::string& word) {
      std::size_t times = 0;
      for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1)) ++times;
      return times;
    };
    for (const std::string word : {"<script", "</script", "<!--"})
      EXPECT_EQ(count(page, word), count(usual, word)) << word;
  }
}

// Of flexel deform: that of a stage, and that of the command, which has the scene's name before it.
TEST(Page, AWarningOfASummaryIsShownOnce) {
  PageOptions options;
  options.words.summary =
      R"({"simulate":{"warnings":["it turned"]},"warnings":["a.toml: it turned","b.toml: it slid"]})";
  const std::string page = make_page({shown(tube(6))}, options, true).html;
  const auto list = page.find(R"("warnings":["a.toml: it turned","b.toml: it slid"])");
  ASSERT_NE(list, page.npos);
  EXPECT_NE(page.find(R"("warnings":["a.toml: it turned","b.toml: it slid"])", list + 1), page.npos);
}

TEST(Page, IsLightAndRepeatable) {
  EXPECT_LT(page_weight(), 2'000'000U);
  EXPECT_EQ(make_page({shown(tube(6))}, {}, true).html, make_page({shown(tube(6))}, {}, true).html);
  EXPECT_EQ(page_files().three.find("</script"), std::string_view::npos);
  EXPECT_EQ(page_files().script.find("</script"), std::string_view::npos);
}

TEST(Page, TooLargeIsRefused) {
  try {
    write_page({shown(tube(6))}, {}, 1000, " (--limit)", "page.html");
    FAIL() << "nothing is thrown";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--limit"), std::string::npos) << error.what();
  }
}

TEST(Page, ASummaryThatIsNone) {
  for (const std::string& text :
       {std::string("["), std::string("[1]"), std::string("3"), std::string(5000, '[')}) {
    PageOptions options;
    options.words.summary = text;
    EXPECT_THROW((void)make_page({shown(tube(6))}, options, true), InputError) << text;
  }
}

TEST(View, AnUnknownAttributeIsNamed) {
  ViewSubject subject;
  subject.surface = tube(6);
  Progress silent("test", Progress::Mode::silent);
  EXPECT_THROW((void)make_view_file(subject, {false, "quality"}, silent), InputError);
  EXPECT_NO_THROW((void)make_view_file(subject, {false, "none"}, silent));
}

}  // namespace
}  // namespace flexel::view
