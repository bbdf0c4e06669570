// The lines of a drawing: outlines, creases, borders of faces, as far as they can be seen.
#pragma once
#include "flexel/picture/canvas/image.h"
#include "flexel/picture/render/camera.h"
#include "flexel/picture/render/drawable.h"

namespace flexel::picture {

enum class LineKind : std::uint8_t {
  outline,  // against the background
  step,     // against something farther away
  crease,   // both sides are seen
  border    // EdgeKind::border
};

// A visible piece of a line, in pixels of the whole picture.
struct ScreenLine {
  Eigen::Vector2f from, to;
  LineKind kind = LineKind::outline;
  bool behind = false;  // the shape as it is now lies in front of it
};

// The shape as it is now, beside its lines at rest: the same triangles.
struct Moved {
  const Drawable& drawn;
  const Tracer& tracer;
};

// The lines of `drawn` that nothing of itself hides. Outlines and steps are the edges between a triangle that
// faces the camera and one that does not, where the view beside them falls away by more than a hundredth of
// the part's radius. `front`, where given, is what may lie in front of the lines (ScreenLine::behind).
[[nodiscard]] std::vector<ScreenLine> visible_lines(const Drawable& drawn, const Tracer& tracer,
                                                    const Camera& camera, const Moved* moved = nullptr);

// Line widths fit for a picture of 1600 x 1200 at `scale` 1.
struct LineStyle {
  float scale = 1;
  Colour ink = colour(0x1c2733);
  Colour ink_on_dark = colour(0x9aa3ae);  // for lines inside the outline
  float strength = 1;                     // how opaque lines are
  float strength_behind = 1;              // the same where ScreenLine::behind
};
void draw_lines(Image& image, const std::vector<ScreenLine>& lines, const LineStyle& style);

}  // namespace flexel::picture
