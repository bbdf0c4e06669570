// Text in a picture. All use of FreeType is in text.cpp; the font (DejaVu Sans) is part of the program.
#pragma once
#include <string>

#include "flexel/picture/canvas/image.h"

namespace flexel::picture {

// Where the point given to draw_text lies in the text.
enum class Anchor { left, middle, right };

// Width in pixels of one line of UTF-8 text, `size` pixels to the em.
[[nodiscard]] float text_width(const std::string& text, float size);

// Draws one line of text with its base line at `y`.
void draw_text(Image& image, float x, float y, const std::string& text, float size, const Colour& ink,
               Anchor anchor = Anchor::left);

// The text, shortened in its middle ("a_very…part.stl") until it is no wider than `width`.
[[nodiscard]] std::string shortened(const std::string& text, float size, float width);

}  // namespace flexel::picture
