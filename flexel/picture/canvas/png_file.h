// PNG files.
#pragma once
#include "base/files/files.h"
#include "flexel/picture/canvas/image.h"

namespace flexel::picture {

// PNG, 8 bits a channel, with the programs' name in it. All use of libpng is in png_file.cpp.
[[nodiscard]] Bytes encode_png(const Image& image);

}  // namespace flexel::picture
