// Legend, axes and scale bar.
#include "flexel/picture/render/annotate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "flexel/picture/canvas/colour_map.h"
#include "flexel/picture/canvas/text.h"

namespace flexel::picture {
namespace {

constexpr int kMostTicks = 7;

Ticks legend_ticks(const Legend& legend) {
  return round_ticks(legend.low / legend.unit.factor, legend.high / legend.unit.factor, kMostTicks);
}

std::string extreme_text(const char* which, double value, const Legend& legend) {
  // Rounding errors of a zero are no value.
  const double size = std::max(std::abs(legend.smallest), std::abs(legend.largest));
  const double shown = std::abs(value) < 1e-6 * size ? 0 : value;
  return fmt::format("{} {} {}", which, short_number(shown / legend.unit.factor), legend.unit.name);
}

// The largest and the smallest value that there are, the smallest unless it is the bar's plain end at zero.
std::vector<std::string> extremes(const Legend& legend) {
  std::vector<std::string> lines{extreme_text("max", legend.largest, legend)};
  if (legend.smallest < 0 || legend.low > 0) lines.push_back(extreme_text("min", legend.smallest, legend));
  return lines;
}

std::string title_text(const Legend& legend) {
  std::string text = legend.title;
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

struct Axis {
  const char* name;
  Vec3f direction;
  std::uint32_t ink;
};

void draw_axis(Image& image, const Eigen::Vector2f& origin, float length, float size, const Axis& axis,
               const Camera& camera) {
  const Eigen::Vector2f along(camera.right.dot(axis.direction), -camera.up.dot(axis.direction));
  const Eigen::Vector2f tip = origin + length * along;
  const float width = size / 10;
  const Colour ink = colour(axis.ink);
  draw_stroke(image, origin, tip, width, ink);
  const float shown = along.norm();
  if (shown > 0.25f) {
    const Eigen::Vector2f unit = along / shown, across(-unit.y(), unit.x());
    for (const float side : {-1.0f, 1.0f})
      draw_stroke(image, tip, tip - 0.45f * size * unit + side * 0.24f * size * across, width, ink);
  }
  const Eigen::Vector2f word = tip + (shown > 0.05f ? Eigen::Vector2f(0.75f * size * along / shown)
                                                    : Eigen::Vector2f(-0.6f * size, 0.6f * size));
  draw_text(image, word.x(), word.y() + 0.36f * size, axis.name, size, ink, Anchor::middle);
}

}  // namespace

int legend_width(float size, const Legend& legend) {
  float widest = 0;
  for (const std::string& label : legend_ticks(legend).labels)
    widest = std::max(widest, text_width(label, size));
  float width = std::max(2 * size + widest, text_width(title_text(legend), size));
  for (const std::string& line : extremes(legend)) width = std::max(width, text_width(line, size));
  return static_cast<int>(std::ceil(width));
}

void draw_legend(Image& image, const Viewport& box, float size, const Legend& legend) {
  const auto left = static_cast<float>(box.x);
  const float line = 1.35f * size;
  const float title = static_cast<float>(box.y) + size,
              top = title + (legend.unit.name.empty() ? 0.6f : 1.0f) * line + 0.3f * size;
  const float bottom = static_cast<float>(box.y + box.height) - 2.9f * line;
  draw_text(image, left, title, title_text(legend), size, colour(kInk));
  if (!legend.unit.name.empty())
    draw_text(image, left, title + line * 0.95f, legend.unit.name, size, colour(kFaintInk));
  const float bar_top = std::round(top + 0.5f * size), bar_bottom = std::round(bottom),
              width = std::round(1.1f * size);
  for (float y = bar_top; y < bar_bottom; ++y)
    fill_rectangle(image, left, y, left + width, y + 1,
                   colour_of(1 - (y + 0.5f - bar_top) / (bar_bottom - bar_top)));
  const Ticks ticks = legend_ticks(legend);
  for (std::size_t i = 0; i < ticks.values.size(); ++i) {
    const double share = (ticks.values[i] * legend.unit.factor - legend.low) / (legend.high - legend.low);
    const float y = bar_bottom - static_cast<float>(share) * (bar_bottom - bar_top);
    draw_stroke(image, {left + width, y}, {left + width + 0.3f * size, y}, std::max(1.0f, size / 16),
                colour(kInk));
    draw_text(image, left + width + 0.6f * size, y + 0.36f * size, ticks.labels[i], size, colour(kInk));
  }
  float below = bar_bottom + 1.3f * line;
  for (const std::string& text : extremes(legend)) {
    draw_text(image, left, below, text, size, colour(kFaintInk));
    below += line;
  }
}

void draw_triad(Image& image, float x, float y, float size, const Camera& camera) {
  std::array<Axis, 3> axes{
      {{"x", Vec3f::UnitX(), 0xc23b33}, {"y", Vec3f::UnitY(), 0x2f8f46}, {"z", Vec3f::UnitZ(), 0x2f66c4}}};
  // The farthest first.
  std::stable_sort(axes.begin(), axes.end(), [&](const Axis& a, const Axis& b) {
    return a.direction.dot(camera.forward) > b.direction.dot(camera.forward);
  });
  for (const Axis& axis : axes) draw_axis(image, {x, y}, 2.2f * size, size, axis, camera);
}

float draw_scale_bar(Image& image, float x, float y, float size, double pixels_per_metre, float most) {
  const double length = round_below(static_cast<double>(most) / pixels_per_metre);
  const DisplayUnit unit = display_unit(Dimension::length, length);
  const auto width = static_cast<float>(length * pixels_per_metre);
  const float stroke = std::max(1.0f, size / 10);
  const Eigen::Vector2f left(x, y), right(x + width, y), up(0, 0.28f * size);
  for (const auto& [from, to] :
       {std::pair(left, right), std::pair<Eigen::Vector2f, Eigen::Vector2f>(left - up, left + up),
        std::pair<Eigen::Vector2f, Eigen::Vector2f>(right - up, right + up)})
    draw_stroke(image, from, to, stroke, colour(kInk));
  draw_text(image, x + width / 2, y - 0.55f * size,
            fmt::format("{} {}", short_number(length / unit.factor), unit.name), size, colour(kInk),
            Anchor::middle);
  return width;
}

}  // namespace flexel::picture
