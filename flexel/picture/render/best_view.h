// Chooses the view automatically.
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

// The best of 24 views from above (eight azimuths, three elevations) by three criteria: viewpoint entropy,
// that is many faces with similar shares of the picture (P.-P. Vazquez et al., VMV 2001); little occlusion;
// and much of the displacement across the line of sight. The usual view from the front right wins near ties.
[[nodiscard]] View best_view(const std::vector<ViewSubject>& subjects, double aspect, Up up = Up::z);

}  // namespace flexel::picture
