// Panels in a grid, and the scale that fits all of them.
#include "flexel/picture/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace flexel::picture {
namespace {

struct Grid {
  int columns = 1, rows = 1;
};

// The grid whose panels are nearest to 4:3 and largest.
Grid best_grid(std::size_t panels, double width, double height) {
  Grid best;
  double largest = 0;
  for (int columns = 1; columns <= static_cast<int>(panels); ++columns) {
    const int rows = (static_cast<int>(panels) + columns - 1) / columns;
    const double side = std::min(width / columns / 4, height / rows / 3);
    if (side > largest * 1.0001) {
      largest = side;
      best = {columns, rows};
    }
  }
  return best;
}

Eigen::Vector4f extent_of(const Panel& panel, const Camera& camera) {
  Eigen::Vector4f box(1e30f, 1e30f, -1e30f, -1e30f);
  const auto add = [&](const Eigen::Vector4f& other) {
    box = Eigen::Vector4f(std::min(box[0], other[0]), std::min(box[1], other[1]), std::max(box[2], other[2]),
                          std::max(box[3], other[3]));
  };
  if (!panel.drawn.triangles.empty()) add(extent(camera, panel.drawn.vertices));
  if (panel.rest) add(extent(camera, panel.rest->vertices));
  for (const Eigen::Vector4f& sphere : panel.drawn.spheres) {
    const Vec3f centre = sphere.head<3>();
    const Eigen::Vector4f at = extent(camera, {&centre, 1});
    add(at + sphere.w() * Eigen::Vector4f(-1, -1, 1, 1));
  }
  return box;
}

}  // namespace

Layout lay_out(std::size_t panels, const PictureOptions& options, const Legend* legend) {
  Layout layout;
  const auto width = static_cast<float>(options.width), height = static_cast<float>(options.height);
  layout.text = std::max(9.0f, 21 * std::min(width / 1600, height / 1200));
  layout.labels = panels > 1;
  const float margin = 2.4f * layout.text;
  const auto whole = [](float x) { return static_cast<int>(std::lround(x)); };
  float right = width - margin;
  if (legend != nullptr) {
    const int taken = legend_width(layout.text, *legend);
    const float tall = std::min(height - 2 * margin, 24 * layout.text);
    layout.legend = {whole(width - margin) - taken, whole((height - tall) / 2), taken, whole(tall)};
    right = static_cast<float>(layout.legend.x) - margin;
  }
  layout.foot = height - 1.6f * margin;
  const float bottom = height - 3.2f * margin, label = layout.labels ? 2.4f * layout.text : 0;
  const Grid grid = best_grid(panels, right - margin, bottom - margin);
  const float across = (right - margin) / static_cast<float>(grid.columns),
              down = (bottom - margin) / static_cast<float>(grid.rows);
  constexpr float kLeast = 8;  // pixels of a panel
  if (panels > 1 && (across - layout.text < kLeast || down - label - layout.text < kLeast))
    throw InputError(fmt::format("--size {}x{} leaves no room for {} panels: give a larger one",
                                 options.width, options.height, panels));
  for (std::size_t p = 0; p < panels; ++p) {
    const auto column = static_cast<float>(static_cast<int>(p) % grid.columns),
               row = static_cast<float>(static_cast<int>(p) / grid.columns);
    const float gap = grid.columns > 1 ? layout.text : 0;
    layout.panels.push_back({whole(margin + column * across + gap / 2), whole(margin + row * down + label),
                             std::max(1, whole(across - gap)),
                             std::max(1, whole(down - label - (grid.rows > 1 ? layout.text : 0)))});
  }
  return layout;
}

Framing frame_panels(const std::vector<Panel>& panels, const Layout& layout, const std::vector<View>& views) {
  Framing framing;
  framing.common_view = views.size() == 1;
  const auto view_of = [&](std::size_t p) { return views.size() > 1 ? views[p] : views[0]; };
  std::vector<Eigen::Vector4f> boxes;
  std::vector<double> fit;  // pixels a metre
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const Camera camera = camera_towards(view_of(p));
    const Eigen::Vector4f box = extent_of(panels[p], camera);
    const double width = std::max(1e-6f, box[2] - box[0]), height = std::max(1e-6f, box[3] - box[1]);
    const double pixels =
        std::min((layout.panels[p].width - 4) / width, (layout.panels[p].height - 4) / height);
    boxes.push_back(box);
    fit.push_back(std::max(pixels, 1e-3) / panels[p].frame.radius);
  }
  const double least = *std::min_element(fit.begin(), fit.end()),
               most = *std::max_element(fit.begin(), fit.end());
  framing.common_scale = most <= 4 * least;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    Camera camera = camera_towards(view_of(p));
    const Viewport& room = layout.panels[p];
    camera.pixels = static_cast<float>((framing.common_scale ? least : fit[p]) * panels[p].frame.radius);
    camera.x = static_cast<float>(room.x) + static_cast<float>(room.width) / 2 -
               camera.pixels * (boxes[p][0] + boxes[p][2]) / 2;
    camera.y = static_cast<float>(room.y) + static_cast<float>(room.height) / 2 +
               camera.pixels * (boxes[p][1] + boxes[p][3]) / 2;
    framing.cameras.push_back(camera);
  }
  return framing;
}

}  // namespace flexel::picture
