// OFF files (Geomview's "Object File Format", text), taken apart into the words that they are made of, for
// reading a file and for writing it again with other coordinates. Only the reader of OFF files and the writer
// of surfaces use this.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace flexel {

using OffTriple = std::array<std::string_view, 3>;
// Red, green, blue, opacity; what is not there is empty.
using OffColor = std::array<std::string_view, 4>;

struct OffFile {
  std::vector<OffTriple> positions;     // (vertices)
  std::vector<OffTriple> normals;       // (vertices), or empty (NOFF)
  std::vector<OffColor> vertex_colors;  // (vertices), or empty (COFF)
  std::vector<std::uint32_t> offsets;   // (faces + 1)
  std::vector<std::uint32_t> corners;   // indices of vertices, in range
  std::vector<OffColor> face_colors;    // (faces), or empty where no face has one
};

// The words point into `text`. Throws InputError (`where`:line): no OFF file, a kind that is not read (4OFF,
// nOFF, BINARY), cut off, not a number, an index out of range.
[[nodiscard]] OffFile parse_off(std::string_view text, const std::string& where);

// True when the first word is that of an OFF file ("OFF", "COFF", "NOFF", "STOFF" ...).
[[nodiscard]] bool looks_like_off(std::string_view text);

// A word as a number. Throws InputError(where, ...): not a finite number.
[[nodiscard]] double off_number(std::string_view word, const std::string& where);

}  // namespace flexel
