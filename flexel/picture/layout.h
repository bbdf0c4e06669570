// The layout of a picture: panels, legend, axes, scale bar.
#pragma once
#include <vector>

#include "flexel/picture/panel.h"
#include "flexel/picture/render/annotate.h"

namespace flexel::picture {

// The picture's text is `text` pixels to the em. Panels stand side by side, in as many rows as gives them the
// most room; below them run the axes and the scale bar, at the right the legend.
struct Layout {
  float text = 20;
  std::vector<Viewport> panels;
  Viewport legend;
  float foot = 0;  // y of the scale bar
  bool labels = false;
};

[[nodiscard]] Layout lay_out(std::size_t panels, const PictureOptions& options, const Legend* legend);

// Cameras that fit the panels into their viewports, all at one scale unless some part would then be smaller
// than a quarter of the largest. Returns whether it is one scale.
struct Framing {
  std::vector<Camera> cameras;
  bool common_scale = true;
  bool common_view = true;
};
// views: (panels), or one for all.
[[nodiscard]] Framing frame_panels(const std::vector<Panel>& panels, const Layout& layout,
                                   const std::vector<View>& views);

}  // namespace flexel::picture
