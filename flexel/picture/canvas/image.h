// A picture in memory, and its file.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel::picture {

// sRGB, 0 to 1.
using Colour = Eigen::Vector3f;

// 0xrrggbb.
[[nodiscard]] constexpr float channel(std::uint32_t rgb, int shift) {
  return static_cast<float>((rgb >> shift) & 0xffu) / 255.0f;
}
[[nodiscard]] inline Colour colour(std::uint32_t rgb) {
  return {channel(rgb, 16), channel(rgb, 8), channel(rgb, 0)};
}
[[nodiscard]] Colour to_linear(const Colour& srgb);
[[nodiscard]] Colour to_srgb(const Colour& linear);

struct Image {
  int width = 0, height = 0;
  std::vector<Colour> pixels;  // (height x width), rows from the top

  Image(int w, int h, const Colour& fill)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), fill) {}
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  // Lays `over` on the pixel, covering this share of it. Outside: nothing.
  void blend(int x, int y, const Colour& over, float share) {
    if (contains(x, y)) pixels[index(x, y)] += share * (over - pixels[index(x, y)]);
  }
};

// Rectangle with sharp edges at whole or broken pixel coordinates.
void fill_rectangle(Image& image, float left, float top, float right, float bottom, const Colour& fill,
                    float share = 1);

// A line with round ends, laid on by itself. Coordinates and width in pixels.
void draw_stroke(Image& image, const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width,
                 const Colour& ink);

// Lines of one colour, gathered before they are laid on, so that where they overlap nothing gets darker.
class LineLayer {
 public:
  LineLayer(int width, int height);
  // A line with round ends. Coordinates and width in pixels; `share` is how opaque it is.
  void add(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width, float share = 1);
  // In `ink`, or in `ink_on_dark` where the image is dark.
  void lay_on(Image& image, const Colour& ink, const Colour& ink_on_dark) const;

 private:
  int width_, height_;
  std::vector<float> cover_;  // (height x width)
};

}  // namespace flexel::picture
