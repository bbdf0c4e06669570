// Blanks separate words; a comment goes from # to the end of its line. A face's colour is what follows its
// corners on the line (Geomview's rule). Where the file has one line per vertex and face, as all programs
// write it, the rest of a vertex's line belongs to it; else a vertex has the number of words that the keyword
// states.
#include "formats/off/off_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace flexel {
namespace {

// What the keyword says of the vertices.
struct Kind {
  bool texture = false, color = false, normal = false;
  bool four = false, many = false;
};

bool parse_keyword(std::string_view word, Kind& kind) {
  const auto take = [&](std::string_view prefix) {
    if (!word.starts_with(prefix)) return false;
    word.remove_prefix(prefix.size());
    return true;
  };
  kind.texture = take("ST");
  kind.color = take("C");
  kind.normal = take("N");
  kind.four = take("4");
  kind.many = take("n");
  return word == "OFF";
}

class Words {
 public:
  Words(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}", where_, line_), what);
  }
  // The next word, from whatever line; "" at the end.
  std::string_view next() {
    skip(true);
    return take();
  }
  // The next word of this line; "" where it ends.
  std::string_view next_on_line() {
    skip(false);
    return take();
  }
  std::string_view required(const char* what) {
    const std::string_view word = next();
    if (word.empty()) fail(fmt::format("the file is cut off: {} expected", what));
    return word;
  }
  std::uint64_t whole(const char* what) {
    const std::string_view word = required(what);
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size())
      fail(fmt::format("\"{}\" is not {}", shown(word), what));
    return value;
  }
  [[nodiscard]] std::string_view rest() const { return text_.substr(at_); }

 private:
  void skip(bool lines) {
    while (at_ < text_.size()) {
      if (text_[at_] == '#')
        at_ = std::min(text_.find('\n', at_), text_.size());
      else if (text_[at_] == '\n' && !lines)
        return;
      else if (blank(text_[at_]))
        line_ += text_[at_++] == '\n';
      else
        return;
    }
  }
  std::string_view take() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !blank(text_[at_]) && text_[at_] != '#') ++at_;
    return text_.substr(begin, at_ - begin);
  }

  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0, line_ = 1;
};

// True where every vertex and every face has a line of its own.
bool written_by_lines(std::string_view text, std::uint64_t vertices, std::uint64_t faces) {
  std::uint64_t lines = 0;
  const std::string nowhere;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    Words words(text.substr(0, end), nowhere);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::string_view first = words.next();
    if (first.empty()) continue;
    std::uint64_t needed = 3;
    if (lines++ >= vertices) {
      const auto [stop, error] = std::from_chars(first.data(), first.data() + first.size(), needed);
      if (error != std::errc{} || stop != first.data() + first.size()) return false;
      ++needed;
    }
    for (std::uint64_t found = 1; found < needed; ++found)
      if (words.next().empty()) return false;
  }
  return lines == vertices + faces;
}

Kind read_keyword(Words& words, const std::string& where) {
  Kind kind;
  const std::string_view keyword = words.next();
  if (!parse_keyword(keyword, kind))
    throw InputError(where, "is no OFF file: it does not begin with the word OFF");
  if (kind.four || kind.many)
    words.fail(fmt::format("{} has points of another dimension than three, which are not read", keyword));
  return kind;
}

// The words that follow a vertex's position.
void read_vertex_attributes(Words& words, const Kind& kind, bool by_lines, OffFile& file) {
  if (kind.normal) {
    OffTriple normal;
    for (std::string_view& word : normal) word = words.required("a normal");
    file.normals.push_back(normal);
  }
  if (!by_lines) {
    OffColor color;
    if (kind.color) {
      for (std::string_view& word : color) word = words.required("a colour");
      file.vertex_colors.push_back(color);
    }
    for (int i = 0; kind.texture && i < 2; ++i) static_cast<void>(words.required("a texture coordinate"));
    return;
  }
  std::vector<std::string_view> rest;
  for (std::string_view word = words.next_on_line(); !word.empty(); word = words.next_on_line())
    rest.push_back(word);
  if (!kind.color) return;
  const std::size_t count = rest.size() - std::min<std::size_t>(rest.size(), kind.texture ? 2 : 0);
  if (count != 3 && count != 4) words.fail("a vertex's colour has neither three nor four numbers");
  OffColor color;
  std::copy_n(rest.begin(), count, color.begin());
  file.vertex_colors.push_back(color);
}

void read_face(Words& words, std::uint64_t vertices, OffFile& file) {
  const std::uint64_t corners = words.whole("the number of a face's corners");
  if (corners < 3) words.fail(fmt::format("a face has {} corners, fewer than three", corners));
  if (corners > words.rest().size()) words.fail("the file is cut off: a face has more corners than are left");
  for (std::uint64_t i = 0; i < corners; ++i) {
    const std::uint64_t vertex = words.whole("the index of a vertex");
    if (vertex >= vertices)
      words.fail(fmt::format("a face names vertex {} (from 0), but there are only {}", vertex, vertices));
    file.corners.push_back(static_cast<std::uint32_t>(vertex));
  }
  if (file.corners.size() > 0xffffffffu) words.fail("the file holds too many faces");
  file.offsets.push_back(static_cast<std::uint32_t>(file.corners.size()));
  OffColor color;
  std::size_t count = 0;
  for (std::string_view word = words.next_on_line(); !word.empty(); word = words.next_on_line())
    if (count++ < color.size()) color[count - 1] = word;
  const bool given = count == 3 || count == 4;  // one number is an index into a table that is not in the file
  if (given && file.face_colors.empty()) file.face_colors.resize(file.offsets.size() - 2);
  if (given)
    file.face_colors.push_back(color);
  else if (!file.face_colors.empty())
    file.face_colors.emplace_back();
}

}  // namespace

OffFile parse_off(std::string_view text, const std::string& where) {
  Words words(text, where);
  const Kind kind = read_keyword(words, where);
  std::string_view rest = words.rest();
  rest.remove_prefix(
      std::min(static_cast<std::size_t>(std::find_if_not(rest.begin(), rest.end(), blank) - rest.begin()),
               rest.size()));
  if (rest.starts_with("BINARY")) words.fail("binary OFF is not read: write it as text");
  const std::uint64_t vertices = words.whole("the number of vertices"),
                      faces = words.whole("the number of faces");
  while (!words.next_on_line().empty()) continue;  // the number of edges, which says nothing
  if (vertices > words.rest().size() / 5 || faces > words.rest().size() / 7 + 1)
    throw InputError(where,
                     fmt::format("is cut off: it announces {} vertices and {} faces", vertices, faces));
  const bool by_lines = written_by_lines(words.rest(), vertices, faces);
  OffFile file;
  file.positions.reserve(vertices);
  for (std::uint64_t v = 0; v < vertices; ++v) {
    OffTriple position;
    for (std::string_view& word : position) word = words.required("a coordinate");
    file.positions.push_back(position);
    read_vertex_attributes(words, kind, by_lines, file);
  }
  file.offsets.push_back(0);
  for (std::uint64_t f = 0; f < faces; ++f) read_face(words, vertices, file);
  return file;
}

bool looks_like_off(std::string_view text) {
  const std::string where;
  Kind kind;
  return parse_keyword(Words(text, where).next(), kind);
}

double off_number(std::string_view word, const std::string& where) {
  std::string_view digits = word;
  if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool number = !digits.empty() && end == digits.data() + digits.size();
  const bool underflow = error == std::errc::result_out_of_range &&
                         digits.find_first_of("eE") != std::string_view::npos &&
                         digits[digits.find_first_of("eE") + 1] == '-';
  if (underflow && number) return 0;
  if (!number || error != std::errc{} || !std::isfinite(value))
    throw InputError(where, fmt::format("\"{}\" is not a finite number", shown(word)));
  return value;
}

}  // namespace flexel
