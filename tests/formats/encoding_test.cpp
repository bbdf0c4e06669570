// Text comes in UTF-8, with or without its mark; in any other encoding it is refused, never read as another
// shape.
#include <gmock/gmock.h>

#include "tests/formats/import_help.h"

namespace flexel::test {
namespace {

using ::testing::HasSubstr;

const std::string kObj = "v 0 0 0\nv 20 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const std::string kOff = "OFF\n4 4 0\n0 0 0\n20 0 0\n0 10 0\n0 0 10\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
const std::string kPlyText =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n20 0 0\n0 10 0\n3 0 1 2\n";
const std::string kStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 20 0 0\nvertex 0 10 0\nendloop\nendfacet\n"
    "endsolid a\n";

// Each character as `width` bytes, the most significant first or last.
std::string widened(const std::string& text, std::size_t width, bool big_endian) {
  std::string wide;
  for (const char c : text) {
    const std::string zeros(width - 1, '\0');
    wide += big_endian ? zeros + c : c + zeros;
  }
  return wide;
}

TEST(Encoding, TheMarkOfUtf8SaysNothing) {
  const Scratch scratch;
  for (const auto& [name, text] :
       {std::pair{"a.obj", kObj}, {"a.off", kOff}, {"a.ply", kPlyText}, {"a.stl", kStl}}) {
    const Surface plain = import_surface(scratch.write(name, text));
    const Surface marked = import_surface(scratch.write(name, "\xef\xbb\xbf" + text));
    EXPECT_EQ(marked.vertices, plain.vertices) << name;
    EXPECT_EQ(marked.polygon_vertices, plain.polygon_vertices) << name;
  }
}

TEST(Encoding, WideCharactersAreRefusedByTheirName) {
  const Scratch scratch;
  const std::string little = "\xff\xfe", big = "\xfe\xff";
  for (const auto& [name, text] :
       {std::pair{"a.obj", kObj}, {"a.off", kOff}, {"a.ply", kPlyText}, {"a.stl", kStl}}) {
    const auto error = [&, file = std::string(name)](const std::string& bytes) {
      return import_error(scratch.write(file, bytes));
    };
    EXPECT_THAT(error(little + widened(text, 2, false)), HasSubstr("is text in UTF-16LE")) << name;
    EXPECT_THAT(error(big + widened(text, 2, true)), HasSubstr("is text in UTF-16BE")) << name;
    EXPECT_THAT(error(widened(text, 2, false)), HasSubstr("iconv -f UTF-16LE -t UTF-8 " + std::string(name)));
    EXPECT_THAT(error(widened(text, 2, true)), HasSubstr("is text in UTF-16BE")) << name;
    EXPECT_THAT(error(widened(text, 4, false)), HasSubstr("is text in UTF-32LE")) << name;
    EXPECT_THAT(error(widened(text, 4, true)), HasSubstr("is text in UTF-32BE")) << name;
  }
}

TEST(Encoding, ANulInsideTextIsAnErrorWithItsLine) {
  const Scratch scratch;
  const std::string nul(1, '\0');
  EXPECT_THAT(import_error(scratch.write("a.obj", replaced(kObj, "v 20", "v 2" + nul + "0"))),
              HasSubstr("a.obj:2|holds a byte that is 0"));
  EXPECT_THAT(import_error(scratch.write("a.off", replaced(kOff, "20 0", "2" + nul + "0 0"))),
              HasSubstr("a.off:4|holds a byte that is 0"));
  EXPECT_THAT(import_error(scratch.write("a.ply", replaced(kPlyText, "20 0", "2" + nul + "0 0"))),
              HasSubstr("a.ply:11|holds a byte that is 0"));
  EXPECT_NE(import_error(scratch.write("a.stl", replaced(kStl, "20 0", "2" + nul + "0 0"))), "");
  // Padding at the end is none of the text.
  EXPECT_EQ(import_surface(scratch.write("b.obj", kObj + std::string(100, '\0'))).vertices.size(), 4u);
  EXPECT_EQ(import_surface(scratch.write("b.stl", kStl + std::string(100, '\0'))).vertices.size(), 3u);
}

}  // namespace
}  // namespace flexel::test
