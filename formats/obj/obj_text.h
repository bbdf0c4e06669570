// The lines of an OBJ file (Wavefront, "Object Files", 1995), for reading it and for writing it again with
// other coordinates. Only the reader of OBJ files and the writer of surfaces use this.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/math/vec.h"

namespace flexel {

// A line that says something to us. Lines continued with a backslash are one.
enum class ObjKeyword { vertex, normal, texture, face, group, object, other };

struct ObjLine {
  ObjKeyword keyword = ObjKeyword::other;
  std::string_view text;   // after the keyword, up to the line's end (a comment at its end left off)
  std::size_t number = 0;  // of its first line in the file, from 1
};

// Goes through a file line by line.
class ObjLines {
 public:
  explicit ObjLines(std::string_view text) : text_(text) {}
  // False at the end of the file.
  bool next(ObjLine& line);
  // Where the next line begins: its place in the text.
  [[nodiscard]] std::size_t at() const { return at_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0, number_ = 1;
};

// The next word of a line (blanks and continuations skipped), "" at its end. Takes it off the front of
// `text`.
[[nodiscard]] std::string_view next_word(std::string_view& text);

// The first three numbers of a v or vn line. Throws InputError (`where`:line) when they are fewer or not
// finite.
[[nodiscard]] Vec3 parse_triple(const ObjLine& line, const std::string& where);

constexpr std::int64_t kNoIndex = -1;

// One corner of a face: from 0; normal and texture kNoIndex where there is none.
struct ObjCorner {
  std::int64_t vertex = 0, normal = kNoIndex, texture = kNoIndex;
};

// How many v, vn and vt lines came before, which is what negative indices count back from. Texture coordinates are
// looked at only where they are counted.
struct ObjCounts {
  std::int64_t vertices = 0, normals = 0, textures = kNoIndex;
};

// All numbers of a line, in order; words that are none are left out.
[[nodiscard]] std::vector<double> numbers_of(const ObjLine& line);

// The corners of an f line, into `corners`. Indices above the counts so far are kept: some files list
// vertices after faces; the caller checks them at the end. Throws InputError (`where`:line): malformed, zero,
// counted back to before the first.
void parse_face(const ObjLine& line, const ObjCounts& counts, const std::string& where,
                std::vector<ObjCorner>& corners);

}  // namespace flexel
