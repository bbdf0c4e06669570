// How files of the formats that are read through assimp (the Open Asset Import Library) are told.
#pragma once
#include <cstddef>
#include <string_view>

#include "formats/common/file_format.h"

namespace flexel {

// Whether the first bytes of a file are those of assimp_formats()[format]; false where it has no mark of its own.
[[nodiscard]] bool has_mark(std::string_view beginning, std::size_t format);

}  // namespace flexel
