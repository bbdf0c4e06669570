// A line ends at a newline that no backslash precedes; "\" newline inside a line counts as a blank. Words are
// split at blanks; numbers are read with std::from_chars, which is exact and knows no locale.
#include "formats/obj/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace flexel {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f' || c == '\0';
}

// Length of a line continuation at the front of `text` (a backslash and the line's end), or 0.
std::size_t continuation(std::string_view text) {
  if (text.empty() || text[0] != '\\') return 0;
  if (text.size() > 1 && text[1] == '\n') return 2;
  if (text.size() > 2 && text[1] == '\r' && text[2] == '\n') return 3;
  return 0;
}

[[noreturn]] void fail(const std::string& where, const ObjLine& line, const std::string& what) {
  throw InputError(fmt::format("{}:{}", where, line.number), what);
}

ObjKeyword keyword_of(std::string_view word) {
  if (word == "v") return ObjKeyword::vertex;
  if (word == "vn") return ObjKeyword::normal;
  if (word == "vt") return ObjKeyword::texture;
  if (word == "f" || word == "fo") return ObjKeyword::face;
  if (word == "g") return ObjKeyword::group;
  if (word == "o") return ObjKeyword::object;
  return ObjKeyword::other;
}

// One index of a corner, resolved to count from 0.
std::int64_t resolve(std::string_view digits, std::int64_t count, const ObjLine& line,
                     const std::string& where) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size())
    fail(where, line, fmt::format("\"{}\" is not an index", shown(digits)));
  if (value == 0) fail(where, line, "indices count from 1, but one is 0");
  if (value < -count) fail(where, line, fmt::format("index {} counts back to before the first", value));
  return value > 0 ? value - 1 : count + value;
}

}  // namespace

bool ObjLines::next(ObjLine& line) {
  if (at_ >= text_.size()) return false;
  const std::size_t begin = at_;
  std::size_t comment = std::string_view::npos;
  line.number = number_;
  while (at_ < text_.size() && text_[at_] != '\n') {
    const bool word_begins = at_ == begin || is_blank(text_[at_ - 1]);
    if (text_[at_] == '#' && word_begins && comment == std::string_view::npos) comment = at_;
    const std::size_t skip = continuation(text_.substr(at_, 3));
    number_ += skip > 0;
    at_ += std::max<std::size_t>(skip, 1);
  }
  line.text = text_.substr(begin, std::min(comment, at_) - begin);
  if (at_ < text_.size()) {
    ++at_;
    ++number_;
  }
  line.keyword = keyword_of(next_word(line.text));
  return true;
}

std::string_view next_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t skip = is_blank(text[begin]) ? 1 : continuation(text.substr(begin, 3));
    if (skip == 0) break;
    begin += skip;
  }
  std::size_t end = begin;
  while (end < text.size() && !is_blank(text[end]) && continuation(text.substr(end, 3)) == 0) ++end;
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

Vec3 parse_triple(const ObjLine& line, const std::string& where) {
  std::string_view rest = line.text;
  Vec3 triple;
  for (double& value : triple) {
    const std::string_view word = next_word(rest);
    if (word.empty()) fail(where, line, "three numbers expected");
    const std::string_view digits = word.front() == '+' ? word.substr(1) : word;
    value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (end != digits.data() + digits.size() || error == std::errc::invalid_argument)
      fail(where, line, fmt::format("\"{}\" is not a number", shown(word)));
    const bool underflow =
        error == std::errc::result_out_of_range && digits.find("e-") != std::string_view::npos;
    if (!underflow && (error != std::errc{} || !std::isfinite(value)))
      fail(where, line, fmt::format("\"{}\" is not a finite number", shown(word)));
  }
  return triple;
}

std::vector<double> numbers_of(const ObjLine& line) {
  std::vector<double> numbers;
  std::string_view rest = line.text;
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    if (word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size()) continue;
    // Below what a double holds; those after it must keep their places.
    if (error == std::errc::result_out_of_range) value = 0;
    numbers.push_back(value);
  }
  return numbers;
}

void parse_face(const ObjLine& line, const ObjCounts& counts, const std::string& where,
                std::vector<ObjCorner>& corners) {
  corners.clear();
  std::string_view rest = line.text;
  for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
    const std::size_t slash = word.find('/');
    const std::size_t second = slash == std::string_view::npos ? slash : word.find('/', slash + 1);
    ObjCorner corner{resolve(word.substr(0, slash), counts.vertices, line, where), kNoIndex, kNoIndex};
    if (counts.textures >= 0 && slash != std::string_view::npos)
      if (const std::string_view digits = word.substr(slash + 1, second - slash - 1); !digits.empty())
        corner.texture = resolve(digits, counts.textures, line, where);
    if (second != std::string_view::npos && second + 1 < word.size())
      corner.normal = resolve(word.substr(second + 1), counts.normals, line, where);
    corners.push_back(corner);
  }
  if (corners.size() < 3)
    fail(where, line, fmt::format("a face of {} corners: it takes three", corners.size()));
}

}  // namespace flexel
