// libpng: 8-bit RGB, the sRGB chunk, rows filtered adaptively. An error of libpng that is not for memory is a bug here:
// sizes are checked before.
#include <png.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string_view>

#include "flexel/picture/canvas/png_file.h"

namespace flexel::picture {
namespace {

[[noreturn]] void on_error(png_structp, png_const_charp message) {
  if (std::string_view(message).find("emory") != std::string_view::npos) throw std::bad_alloc();
  throw std::runtime_error(std::string("libpng: ") + message);
}
void on_warning(png_structp, png_const_charp) {}

void append(png_structp png, png_bytep data, png_size_t size) {
  auto& bytes = *static_cast<Bytes*>(png_get_io_ptr(png));
  const auto* first = reinterpret_cast<const std::byte*>(data);
  bytes.insert(bytes.end(), first, first + size);
}
void flush(png_structp) {}

struct Writer {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, on_error, on_warning);
  png_infop info = png_create_info_struct(png);
  Writer() {
    if (png == nullptr || info == nullptr) throw std::bad_alloc();
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
};

}  // namespace

Bytes encode_png(const Image& image) {
  Bytes bytes;
  Writer writer;
  png_set_write_fn(writer.png, &bytes, append, flush);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB_gAMA_and_cHRM(writer.png, writer.info, PNG_sRGB_INTENT_RELATIVE);
  std::string key = "Software", value = "flexel";
  png_text text{};
  text.compression = PNG_TEXT_COMPRESSION_NONE;
  text.key = key.data();
  text.text = value.data();
  png_set_text(writer.png, writer.info, &text, 1);
  png_write_info(writer.png, writer.info);
  std::vector<png_byte> row(3 * static_cast<std::size_t>(image.width));
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c)
        row[3 * static_cast<std::size_t>(x) + static_cast<std::size_t>(c)] = static_cast<png_byte>(
            std::lround(255 * std::clamp(image.pixels[image.index(x, y)][c], 0.0f, 1.0f)));
    png_write_row(writer.png, row.data());
  }
  png_write_end(writer.png, writer.info);
  return bytes;
}

}  // namespace flexel::picture
