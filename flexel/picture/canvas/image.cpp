// Colour spaces, and anti-aliased lines by the distance of a pixel's centre.
#include "flexel/picture/canvas/image.h"

#include <algorithm>
#include <cmath>

namespace flexel::picture {
namespace {

float linear_component(float s) {
  return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}
float srgb_component(float l) {
  const float c = std::clamp(l, 0.0f, 1.0f);
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
}

// How much of pixel [i, i + 1] lies in [from, to].
float overlap(int i, float from, float to) {
  return std::clamp(std::min(to, static_cast<float>(i) + 1) - std::max(from, static_cast<float>(i)), 0.0f,
                    1.0f);
}

// use(x, y, share) for every pixel that a line with round ends covers some of. Lines thinner than a pixel are
// a pixel wide and paler.
template <class Use>
void for_each_covered(int width, int height, const Eigen::Vector2f& from, const Eigen::Vector2f& to,
                      float stroke, const Use& use) {
  const float half = std::max(stroke, 1.0f) / 2 + 0.5f;
  const auto bound = [](float at, int most) {
    return static_cast<int>(std::clamp(std::floor(at), 0.0f, static_cast<float>(most)));
  };
  const int x0 = bound(std::min(from.x(), to.x()) - half, width),
            x1 = bound(std::max(from.x(), to.x()) + half + 1, width);
  const int y0 = bound(std::min(from.y(), to.y()) - half, height),
            y1 = bound(std::max(from.y(), to.y()) + half + 1, height);
  const Eigen::Vector2f along = to - from;
  const float squared = along.squaredNorm();
  for (int y = y0; y < y1; ++y)
    for (int x = x0; x < x1; ++x) {
      const Eigen::Vector2f at(static_cast<float>(x) + 0.5f - from.x(),
                               static_cast<float>(y) + 0.5f - from.y());
      const float where = squared > 0 ? std::clamp(at.dot(along) / squared, 0.0f, 1.0f) : 0.0f;
      const float cover = std::min(stroke, 1.0f) * std::clamp(half - (at - where * along).norm(), 0.0f, 1.0f);
      if (cover > 0) use(x, y, cover);
    }
}

}  // namespace

// IEC 61966-2-1.
Colour to_linear(const Colour& srgb) {
  return srgb.unaryExpr([](float s) { return linear_component(s); });
}
Colour to_srgb(const Colour& linear) {
  return linear.unaryExpr([](float l) { return srgb_component(l); });
}

void fill_rectangle(Image& image, float left, float top, float right, float bottom, const Colour& fill,
                    float share) {
  const int x1 = static_cast<int>(std::ceil(right)), y1 = static_cast<int>(std::ceil(bottom));
  for (int y = static_cast<int>(std::floor(top)); y < y1; ++y)
    for (int x = static_cast<int>(std::floor(left)); x < x1; ++x)
      image.blend(x, y, fill, share * overlap(x, left, right) * overlap(y, top, bottom));
}

void draw_stroke(Image& image, const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width,
                 const Colour& ink) {
  for_each_covered(image.width, image.height, from, to, width,
                   [&](int x, int y, float cover) { image.blend(x, y, ink, cover); });
}

LineLayer::LineLayer(int width, int height)
    : width_(width),
      height_(height),
      cover_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.0f) {}

void LineLayer::add(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float width, float share) {
  for_each_covered(width_, height_, from, to, width, [&](int x, int y, float cover) {
    float& here =
        cover_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
    here = std::max(here, share * cover);
  });
}

void LineLayer::lay_on(Image& image, const Colour& ink, const Colour& ink_on_dark) const {
  constexpr float kDark = 0.24f, kBright = 0.32f;  // luma: below, the one ink; above, the other
  for (std::size_t i = 0; i < cover_.size(); ++i) {
    if (cover_[i] <= 0) continue;
    const float luma = image.pixels[i].dot(Colour(0.299f, 0.587f, 0.114f));
    const float bright = std::clamp((luma - kDark) / (kBright - kDark), 0.0f, 1.0f);
    image.pixels[i] += cover_[i] * (ink_on_dark + bright * (ink - ink_on_dark) - image.pixels[i]);
  }
}

}  // namespace flexel::picture
