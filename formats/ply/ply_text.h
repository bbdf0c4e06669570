// PLY files (G. Turk, "The PLY polygon file format", 1994): the header, and walking through the values after
// it, for reading a file and for writing it again with other coordinates. Only the reader of PLY files and
// the writer of surfaces use this.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel {

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
[[nodiscard]] std::size_t size_of(PlyType type);  // bytes
[[nodiscard]] constexpr bool is_float(PlyType type) {
  return type == PlyType::float32 || type == PlyType::float64;
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;
  bool list = false;
  PlyType count_type = PlyType::uint8;  // of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding { ascii, little_endian, big_endian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::size_t size = 0;  // bytes, with its last newline
};

// The words of a line of the header.
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view line);

// Throws InputError: no PLY file, cut off, a line that makes no sense, more elements than the file has room
// for.
[[nodiscard]] PlyHeader parse_ply_header(std::span<const std::byte> bytes, const std::string& where);

// The values after the header, one after the other.
class PlyValues {
 public:
  // All must outlive this.
  PlyValues(std::span<const std::byte> bytes, const PlyHeader& header, const std::string& where);
  // Names what is read next, for messages.
  void at(const PlyElement& element, std::uint64_t index) {
    element_ = &element;
    index_ = index;
  }
  // The next number. Throws InputError: the file ends, or the text is no number of that type.
  double next(PlyType type);
  // The length of a list, which the rest of the file has room for.
  std::size_t next_count(const PlyProperty& property);
  // The bytes of the number that was read last: [begin, end) in the file.
  [[nodiscard]] std::size_t begin() const { return begin_; }
  [[nodiscard]] std::size_t end() const { return at_; }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  double next_word(PlyType type);
  double next_binary(PlyType type);
  std::span<const std::byte> bytes_;
  const std::string& where_;
  PlyEncoding encoding_;
  std::size_t begin_ = 0, at_ = 0;
  const PlyElement* element_ = nullptr;
  std::uint64_t index_ = 0;
};

// `value` as the bytes that a binary file has for it. Integers: the nearest that the type has.
[[nodiscard]] std::string ply_bytes(double value, PlyType type, PlyEncoding encoding);

// Which property of the vertices is x, y, z; and nx, ny, nz. kNoProperty where it is missing, a list, or, for
// normals, no floating-point number.
constexpr std::size_t kNoProperty = static_cast<std::size_t>(-1);
struct PlyVertexLayout {
  std::array<std::size_t, 3> position{}, normal{};
  [[nodiscard]] bool has_normal() const { return normal[0] != kNoProperty; }
};
[[nodiscard]] PlyVertexLayout vertex_layout(const PlyElement& element);

}  // namespace flexel
