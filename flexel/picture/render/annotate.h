// The annotations of a picture: legend, axes, scale bar.
#pragma once
#include <string>
#include <vector>

#include "flexel/picture/canvas/image.h"
#include "flexel/picture/render/camera.h"
#include "flexel/picture/render/quantity.h"

namespace flexel::picture {

constexpr std::uint32_t kInk = 0x27313d, kFaintInk = 0x66717e;

struct Legend {
  std::string title;                 // "displacement"
  double low = 0, high = 1;          // SI, the ends of the colour map
  double smallest = 0, largest = 0;  // SI, of the values that there are
  DisplayUnit unit;
};

// `size`: of the text, in pixels per em; `box`: the space for it.
void draw_legend(Image& image, const Viewport& box, float size, const Legend& legend);
// Width that the legend takes, pixels.
[[nodiscard]] int legend_width(float size, const Legend& legend);

// The directions of x, y and z, about a point.
void draw_triad(Image& image, float x, float y, float size, const Camera& camera);

// A bar of a round length, not longer than `most` pixels, from its left end. Returns its width in pixels.
float draw_scale_bar(Image& image, float x, float y, float size, double pixels_per_metre, float most);

}  // namespace flexel::picture
