// How files of the formats that are read through assimp (the Open Asset Import Library) are told.
#pragma once
#include <cstddef>
#include <string_view>

#include "formats/common/file_format.h"

namespace flexel {

// The bytes that tell a format.
struct FormatMark {
  std::string_view bytes;  // at the front of the file; "": nothing tells it but the extension
  bool in_xml = false;     // or, where XML stands there, among the first
};

// Of assimp_formats()[format].
[[nodiscard]] FormatMark assimp_mark(std::size_t format);

}  // namespace flexel
