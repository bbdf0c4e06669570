// The camera. Orthographic, so that the scale bar holds everywhere.
#pragma once
#include <optional>
#include <span>
#include <string>

#include "flexel/picture/render/drawable.h"

namespace flexel::picture {

// Which axis of the file points up.
enum class Up : std::uint8_t { x, y, z };

// The direction that the camera stands in, as seen from the part: azimuth about the upward axis, from the
// front (with z up 0: at -y, 90: the right, at +x), and elevation above the horizon; degrees. With y up the
// front is at +z, as in glTF; with x up it is at -z, and the right at +y.
struct View {
  double azimuth = 45, elevation = 35.264389682754654;
  Up up = Up::z;
};

// "iso", "front", "back", "left", "right", "top", "bottom", or "AZIMUTH,ELEVATION" in degrees; nothing for
// "auto". Throws InputError, with the nearest word.
[[nodiscard]] std::optional<View> parse_view(const std::string& text);

// A rectangle of pixels.
struct Viewport {
  int x = 0, y = 0, width = 0, height = 0;
};

// The frame of the drawing seen by an orthographic camera. Pixel coordinates are those of the whole picture,
// y down, a pixel's centre at half numbers.
struct Camera {
  Vec3f right = Vec3f::UnitX(), up = Vec3f::UnitZ(), forward = Vec3f::UnitY();
  float pixels = 1;    // per unit of the drawing's frame
  float x = 0, y = 0;  // pixel at which the drawing's origin lies
  [[nodiscard]] Eigen::Vector2f project(const Vec3f& p) const {
    return {x + pixels * right.dot(p), y - pixels * up.dot(p)};
  }
  // From far in front of the unit sphere.
  [[nodiscard]] Ray ray(float pixel_x, float pixel_y) const {
    return {right * ((pixel_x - x) / pixels) + up * ((y - pixel_y) / pixels) - kDistance * forward, forward,
            0, 1e30f};
  }
  [[nodiscard]] float depth(const Vec3f& p) const { return forward.dot(p) + kDistance; }
  static constexpr float kDistance = 4;
};

// Its directions only.
[[nodiscard]] Camera camera_towards(const View& view);

// The rectangle that the points take up: (left, bottom, right, top) along right and up.
[[nodiscard]] Eigen::Vector4f extent(const Camera& camera, std::span<const Vec3f> points);

}  // namespace flexel::picture
