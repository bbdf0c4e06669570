// The header is lines of text, ended by LF or CRLF, in every encoding. Numbers of ASCII files are words, read
// with std::from_chars (exact, no locale); line breaks between them do not matter. The header's counts are
// checked against the number of bytes before anything is read.
#include "formats/ply/ply_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/parallel.h"
#include "base/text.h"

namespace flexel {
namespace {

static_assert(std::endian::native == std::endian::little, "bytes are swapped for big-endian files only");

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::optional<PlyType> type_named(std::string_view name) {
  constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  for (const auto& [known, type] : kNames)
    if (known == name) return type;
  return std::nullopt;
}

// Reads the header line by line.
class HeaderParser {
 public:
  HeaderParser(std::span<const std::byte> bytes, const std::string& where)
      : text_(text_of(bytes)), where_(where) {}

  PlyHeader parse() {
    if (next_line() != std::vector<std::string_view>{"ply"})
      throw InputError(where_, "is no PLY file: it does not begin with a line \"ply\"");
    for (std::vector<std::string_view> words = next_line(); words.empty() || words[0] != "end_header";
         words = next_line())
      if (!words.empty()) add(words);
    if (!format_seen_) fail("the header has no format line");
    header_.size = at_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}", where_, line_), what);
  }

  std::vector<std::string_view> next_line() {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos)
      throw InputError(where_, at_ == 0 ? "is no PLY file: it does not begin with a line \"ply\""
                                        : "is cut off inside its header");
    const std::string_view line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++line_;
    return words_of(line);
  }

  void add(const std::vector<std::string_view>& words) {
    const std::string_view keyword = words[0];
    if (keyword == "comment" || keyword == "obj_info") return;
    if (keyword == "format")
      add_format(words);
    else if (keyword == "element")
      add_element(words);
    else if (keyword == "property")
      add_property(words);
    else
      fail(fmt::format("\"{}\" is no word of a PLY header", shown(keyword)));
  }

  void add_format(const std::vector<std::string_view>& words) {
    const std::string_view name = words.size() < 2 ? std::string_view() : words[1];
    if (name == "ascii")
      header_.encoding = PlyEncoding::ascii;
    else if (name == "binary_little_endian")
      header_.encoding = PlyEncoding::little_endian;
    else if (name == "binary_big_endian")
      header_.encoding = PlyEncoding::big_endian;
    else
      fail(fmt::format("unknown format \"{}\"", shown(name)));
    format_seen_ = true;
  }

  void add_element(const std::vector<std::string_view>& words) {
    if (words.size() < 3) fail("an element line needs a name and a count");
    PlyElement element;
    element.name = shown(words[1]);
    const std::string_view digits = words[2];
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), element.count);
    if (error != std::errc{} || end != digits.data() + digits.size())
      fail(fmt::format("\"{}\" is not a count", shown(digits)));
    header_.elements.push_back(std::move(element));
  }

  PlyType type(std::string_view name) const {
    const std::optional<PlyType> found = type_named(name);
    if (!found) fail(fmt::format("unknown type \"{}\"", shown(name)));
    return *found;
  }

  void add_property(const std::vector<std::string_view>& words) {
    if (header_.elements.empty()) fail("a property without an element");
    PlyProperty property;
    property.list = words.size() > 1 && words[1] == "list";
    if (words.size() < (property.list ? 5u : 3u)) fail("a property line needs a type and a name");
    if (property.list) property.count_type = type(words[2]);
    if (property.list && is_float(property.count_type)) fail("the length of a list must be an integer");
    property.type = type(words[property.list ? 3 : 1]);
    property.name = shown(words[property.list ? 4 : 2]);
    header_.elements.back().properties.push_back(std::move(property));
  }

  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0, line_ = 0;
  bool format_seen_ = false;
  PlyHeader header_;
};

// Least bytes that one entry of an element takes.
std::uint64_t least_size(const PlyElement& element, PlyEncoding encoding) {
  std::uint64_t size = 0;
  for (const PlyProperty& property : element.properties)
    size += encoding == PlyEncoding::ascii ? 2 : size_of(property.list ? property.count_type : property.type);
  return size;
}

void check_counts(const PlyHeader& header, std::size_t file_size, const std::string& where) {
  std::uint64_t left = file_size - header.size + (header.encoding == PlyEncoding::ascii ? 1 : 0);
  for (const PlyElement& element : header.elements) {
    const std::uint64_t size = least_size(element, header.encoding);
    if (size == 0) continue;
    if (element.count > left / size)
      throw InputError(where,
                       fmt::format("is cut off: its header announces {} of element \"{}\", and only {} "
                                   "bytes are left for them",
                                   element.count, element.name, left));
    left -= element.count * size;
  }
}

template <class T>
T from_bytes(const std::byte* bytes, bool swap) {
  std::array<std::byte, sizeof(T)> copy{};
  std::memcpy(copy.data(), bytes, sizeof(T));
  if (swap) std::reverse(copy.begin(), copy.end());
  return std::bit_cast<T>(copy);
}

template <class T>
std::string to_bytes(double value, bool swap) {
  T number{};
  if constexpr (std::is_integral_v<T>)
    number = static_cast<T>(std::clamp(std::round(value), static_cast<double>(std::numeric_limits<T>::min()),
                                       static_cast<double>(std::numeric_limits<T>::max())));
  else
    number = static_cast<T>(value);
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &number, sizeof(T));
  if (swap) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

// Calls work.template operator()<T>() with the C++ type that `type` stands for.
template <class Work>
auto with_type(PlyType type, const Work& work) {
  switch (type) {
    case PlyType::int8:
      return work.template operator()<std::int8_t>();
    case PlyType::uint8:
      return work.template operator()<std::uint8_t>();
    case PlyType::int16:
      return work.template operator()<std::int16_t>();
    case PlyType::uint16:
      return work.template operator()<std::uint16_t>();
    case PlyType::int32:
      return work.template operator()<std::int32_t>();
    case PlyType::uint32:
      return work.template operator()<std::uint32_t>();
    case PlyType::float32:
      return work.template operator()<float>();
    default:
      return work.template operator()<double>();
  }
}

}  // namespace

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && blank(line[at])) ++at;
    const std::size_t begin = at;
    while (at < line.size() && !blank(line[at])) ++at;
    if (at == begin) return words;
    words.push_back(line.substr(begin, at - begin));
  }
}

std::size_t size_of(PlyType type) {
  return with_type(type, []<class T>() { return sizeof(T); });
}

PlyHeader parse_ply_header(std::span<const std::byte> bytes, const std::string& where) {
  PlyHeader header = HeaderParser(bytes, where).parse();
  check_counts(header, bytes.size(), where);
  return header;
}

PlyValues::PlyValues(std::span<const std::byte> bytes, const PlyHeader& header, const std::string& where)
    : bytes_(bytes), where_(where), encoding_(header.encoding), begin_(header.size), at_(header.size) {}

void PlyValues::fail(const std::string& what) const {
  throw InputError(where_,
                   element_ == nullptr ? what : fmt::format("{} {}: {}", element_->name, index_ + 1, what));
}

double PlyValues::next(PlyType type) {
  return encoding_ == PlyEncoding::ascii ? next_word(type) : next_binary(type);
}

double PlyValues::next_word(PlyType type) {
  const std::string_view text = text_of(bytes_);
  while (at_ < text.size() && blank(text[at_])) ++at_;
  begin_ = at_;
  while (at_ < text.size() && !blank(text[at_])) ++at_;
  if (at_ == begin_) fail("the file is cut off here");
  std::string_view word = text.substr(begin_, at_ - begin_);
  if (word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool number = end == word.data() + word.size() && error != std::errc::invalid_argument;
  if (!number || (!is_float(type) && value != std::floor(value)))
    fail(fmt::format("\"{}\" is not {}", shown(word), is_float(type) ? "a number" : "a whole number"));
  if (error == std::errc::result_out_of_range)
    return word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos
               ? 0
               : std::numeric_limits<double>::infinity();
  return value;
}

double PlyValues::next_binary(PlyType type) {
  const std::size_t size = size_of(type);
  if (bytes_.size() - at_ < size) fail("the file is cut off here");
  begin_ = at_;
  at_ += size;
  const bool swap = encoding_ == PlyEncoding::big_endian;
  return with_type(
      type, [&]<class T>() { return static_cast<double>(from_bytes<T>(bytes_.data() + begin_, swap)); });
}

std::size_t PlyValues::next_count(const PlyProperty& property) {
  const double count = next(property.count_type);
  const std::size_t left = bytes_.size() - at_;
  const std::size_t least = encoding_ == PlyEncoding::ascii ? 2 : size_of(property.type);
  if (!(count >= 0) || count > static_cast<double>(left / least + 1))
    fail(fmt::format("a list of {:.0f} is more than the file holds", count));
  return static_cast<std::size_t>(count);
}

std::string ply_bytes(double value, PlyType type, PlyEncoding encoding) {
  const bool swap = encoding == PlyEncoding::big_endian;
  return with_type(type, [&]<class T>() { return to_bytes<T>(value, swap); });
}

PlyVertexLayout vertex_layout(const PlyElement& element) {
  const auto find = [&](const char* name, bool floating) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (property.name == name && !property.list && (!floating || is_float(property.type))) return i;
    }
    return kNoProperty;
  };
  PlyVertexLayout layout{{find("x", false), find("y", false), find("z", false)},
                         {find("nx", true), find("ny", true), find("nz", true)}};
  if (std::find(layout.normal.begin(), layout.normal.end(), kNoProperty) != layout.normal.end())
    layout.normal.fill(kNoProperty);
  return layout;
}

}  // namespace flexel
