// FreeType's own rasterizer with light hinting. The font's file is taken into the program when it is built,
// so that pictures look the same on a machine without fonts.
#include "flexel/picture/canvas/text.h"

#include <ft2build.h>
#include FT_FREETYPE_H
#include FT_OUTLINE_H

#include <cmath>
#include <cstdint>
#include <functional>
#include <new>
#include <stdexcept>

asm(".pushsection .rodata\n"
    ".global flexel_font_begin\n"
    ".global flexel_font_end\n"
    "flexel_font_begin:\n"
    ".incbin \"" FLEXEL_FONT_FILE
    "\"\n"
    "flexel_font_end:\n"
    ".popsection\n");
extern "C" {
extern const unsigned char flexel_font_begin[];
extern const unsigned char flexel_font_end[];
}

namespace flexel::picture {
namespace {

void refuse_lack_of_memory(FT_Error error) {
  constexpr FT_Error kOutOfMemory = 0x40;  // FT_Err_Out_Of_Memory, whose header defines macros by the hundred
  if ((error & 0xff) == kOutOfMemory) throw std::bad_alloc();
}

// One library and face; pictures are annotated by one thread.
class Font {
 public:
  Font() {
    const auto size = static_cast<FT_Long>(flexel_font_end - flexel_font_begin);
    FT_Error error = FT_Init_FreeType(&library_);
    if (error == 0) error = FT_New_Memory_Face(library_, flexel_font_begin, size, 0, &face_);
    refuse_lack_of_memory(error);
    if (error != 0) throw std::runtime_error("FreeType cannot read the built-in font");
  }
  ~Font() {
    FT_Done_Face(face_);
    FT_Done_FreeType(library_);
  }
  Font(const Font&) = delete;
  Font& operator=(const Font&) = delete;
  [[nodiscard]] FT_Face face(float size) const {
    refuse_lack_of_memory(
        FT_Set_Char_Size(face_, 0, static_cast<FT_F26Dot6>(std::lround(64 * size)), 72, 72));
    return face_;
  }

 private:
  FT_Library library_ = nullptr;
  FT_Face face_ = nullptr;
};

// The next code point of UTF-8 text; bytes that are no UTF-8 become the replacement character.
std::uint32_t next_code_point(const std::string& text, std::size_t& at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned lead = byte(at++);
  const int more = lead < 0x80 ? 0 : lead >> 5 == 6 ? 1 : lead >> 4 == 14 ? 2 : lead >> 3 == 30 ? 3 : -1;
  if (more < 0) return 0xfffd;
  std::uint32_t code = more == 0 ? lead : lead & (0x3fu >> more);
  for (int k = 0; k < more; ++k) {
    if (byte(at) >> 6 != 2) return 0xfffd;
    code = code << 6 | (byte(at++) & 0x3fu);
  }
  return code;
}

// Calls use(glyph, pen) for every glyph, and returns the width; pixels.
float for_each_glyph(const std::string& text, FT_Face face,
                     const std::function<void(FT_GlyphSlot, float)>& use) {
  float pen = 0;
  FT_UInt before = 0;
  for (std::size_t at = 0; at < text.size();) {
    const FT_UInt glyph = FT_Get_Char_Index(face, next_code_point(text, at));
    FT_Vector kerning{};
    if (before != 0) FT_Get_Kerning(face, before, glyph, FT_KERNING_UNFITTED, &kerning);
    pen += static_cast<float>(kerning.x) / 64;
    const FT_Error error = FT_Load_Glyph(face, glyph, FT_LOAD_TARGET_LIGHT);
    refuse_lack_of_memory(error);
    if (error != 0) continue;
    use(face->glyph, pen);
    pen += static_cast<float>(face->glyph->linearHoriAdvance) / 65536;
    before = glyph;
  }
  return pen;
}

const Font& font() {
  static const Font one;
  return one;
}

void blend_bitmap(Image& image, const FT_Bitmap& bitmap, int left, int top, const Colour& ink) {
  for (int row = 0; row < static_cast<int>(bitmap.rows); ++row)
    for (int column = 0; column < static_cast<int>(bitmap.width); ++column)
      image.blend(left + column, top + row, ink,
                  static_cast<float>(bitmap.buffer[row * bitmap.pitch + column]) / 255);
}

}  // namespace

float text_width(const std::string& text, float size) {
  return for_each_glyph(text, font().face(size), [](FT_GlyphSlot, float) {});
}

void draw_text(Image& image, float x, float y, const std::string& text, float size, const Colour& ink,
               Anchor anchor) {
  if (anchor != Anchor::left) x -= text_width(text, size) * (anchor == Anchor::middle ? 0.5f : 1.0f);
  const int baseline = static_cast<int>(std::lround(y));
  for_each_glyph(text, font().face(size), [&](FT_GlyphSlot slot, float pen) {
    const float at = x + pen;
    const int whole = static_cast<int>(std::floor(at));
    FT_Outline_Translate(&slot->outline, std::lround(64 * (at - static_cast<float>(whole))), 0);
    const FT_Error error = FT_Render_Glyph(slot, FT_RENDER_MODE_NORMAL);
    refuse_lack_of_memory(error);
    if (error != 0) return;
    blend_bitmap(image, slot->bitmap, whole + slot->bitmap_left, baseline - slot->bitmap_top, ink);
  });
}

std::string shortened(const std::string& text, float size, float width) {
  if (text_width(text, size) <= width) return text;
  for (std::size_t keep = text.size(); keep > 2; --keep) {
    std::size_t head = keep / 2, tail = text.size() - (keep - head);
    const auto inside = [&](std::size_t at) {
      return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80;
    };
    while (inside(head)) ++head;
    while (inside(tail)) ++tail;
    if (head >= tail) continue;
    const std::string shorter = text.substr(0, head) + "\u2026" + text.substr(tail);
    if (text_width(shorter, size) <= width) return shorter;
  }
  return "\u2026";
}

}  // namespace flexel::picture
