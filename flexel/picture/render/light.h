// How much light reaches what the picture shows: ambient occlusion and the soft shadow of a wide lamp.
#pragma once
#include "flexel/picture/render/camera.h"
#include "flexel/picture/render/surfel.h"

namespace flexel::picture {

// What the middle of each pixel of a viewport shows.
struct PixelBuffer {
  int width = 0, height = 0;
  std::vector<Hit> hits;       // (height x width)
  std::vector<Vec3f> normals;  // smooth; valid where something was hit
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

// Shares of the sky and of the lamp that a point sees.
struct Light {
  float sky = 1, lamp = 1;
};

// Unit vector towards the lamp, which stands to the upper left behind the camera.
[[nodiscard]] Vec3f lamp_direction(const Camera& camera);

// Traces the light of each pixel that shows something: few rays a pixel, whose directions differ over tiles
// of 16 x 16 pixels. smooth_light() then takes the mean over such tiles.
[[nodiscard]] std::vector<Light> trace_light(const PixelBuffer& buffer, const Viewport& viewport,
                                             const Camera& camera, const Drawable& drawn,
                                             const Tracer& tracer);

// The mean of the light around each pixel, over pixels on the same smooth surface only; in two passes (H.
// Dammertz et al., "Edge-avoiding a-trous wavelet transform", HPG 2010), the second over pixels 4 apart. The
// weights (1 2 3 4 3 2 1 each way) leave nothing of patterns of period 4 in the first pass and of period 16
// in the second.
[[nodiscard]] std::vector<Light> smooth_light(const std::vector<Light>& light, const PixelBuffer& buffer,
                                              const Camera& camera);

}  // namespace flexel::picture
