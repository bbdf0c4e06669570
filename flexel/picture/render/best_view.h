// Choosing the view.
#pragma once
#include "flexel/picture/render/camera.h"

namespace flexel::picture {

// What a view has to show.
struct ViewSubject {
  const Drawable* drawn = nullptr;
  const Tracer* tracer = nullptr;
  Eigen::Matrix3d motion =
      Eigen::Matrix3d::Zero();  // sum of u u^T over the displacements u; zero where nothing moved
};

// The view, of 24 from above (eight quarters of the horizon, three heights), that shows the most: many faces
// of the part, each with a fair share of the picture (viewpoint entropy: P.-P. Vazquez et al., VMV 2001),
// little of it hidden, and a large part of the displacement across the line of sight. The usual view from the
// front right wins near ties.
[[nodiscard]] View best_view(const std::vector<ViewSubject>& subjects, double aspect, Up up = Up::z);

}  // namespace flexel::picture
