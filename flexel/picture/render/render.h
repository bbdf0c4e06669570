// The shaded picture of a drawable, without lines and text.
#pragma once
#include "flexel/picture/canvas/image.h"
#include "flexel/picture/render/camera.h"
#include "flexel/picture/render/drawable.h"

namespace flexel::picture {

struct ShadeOptions {
  bool by_value = false;    // colour by Drawable::values, else by part
  bool thickness = false;   // colour by the length of the way through matter instead
  float low = 0, high = 1;  // the values at the ends of the colour map
  float unit = 1;           // what a value in the drawing's frame is multiplied by (thickness: m)
};

// Tints of parts, sRGB.
[[nodiscard]] Colour part_tint(std::uint32_t part);

// Shades what the camera sees of `drawn` onto `image` within the viewport, antialiased. The same pixels for
// any number of threads. Tells its share.
void render(Image& image, const Viewport& viewport, const Camera& camera, const Drawable& drawn,
            const Tracer& tracer, const ShadeOptions& options);

// The tracer of a drawable.
[[nodiscard]] Tracer make_tracer(const Drawable& drawn);

}  // namespace flexel::picture
