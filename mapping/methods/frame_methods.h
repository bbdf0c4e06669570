// gram-schmidt and affine: a vertex keeps its coordinates in the base of its frame.
#pragma once
#include "mapping/methods/method.h"

namespace flexel::mapping {

struct FrameCoordinates final : MethodBinding {
  bool orthonormal = false;       // gram-schmidt
  std::vector<Mat3> rest_base;    // (frames)
  std::vector<Vec3> coordinates;  // (vertices x 3) in the rest base of the frame, m or edges
  [[nodiscard]] std::vector<Vec3> apply(const Binding& binding, const Body& body,
                                        const std::vector<Vec3>& position) const override;
};

}  // namespace flexel::mapping
