// Tubes round closed curves, meshed finely, for the benchmarks.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "formats/part/surface.h"

namespace flexel {

// A tube of 2 x along x around triangles, one part: `centre`(t) is a closed curve [m] for t in [0, 2 pi],
// `radius`(t, q) [m] that at the angle q round it. The frame across comes from the tangent and `up`; `step`
// is that of the tangent's differences.
template <class Centre, class Radius>
Surface closed_tube(int along, int around, const Centre& centre, const Radius& radius, const Vec3& up,
                    double step) {
  Surface surface;
  for (int a = 0; a < along; ++a) {
    const double t = 2 * std::numbers::pi * a / along;
    const Vec3 tangent = (centre(t + step) - centre(t - step)).normalized();
    const Vec3 normal = tangent.cross(up).normalized(), binormal = tangent.cross(normal);
    for (int b = 0; b < around; ++b) {
      const double q = 2 * std::numbers::pi * b / around;
      surface.vertices.push_back(centre(t) + radius(t, q) * (std::cos(q) * normal + std::sin(q) * binormal));
    }
  }
  const auto at = [&](int a, int b) { return static_cast<std::uint32_t>(a % along * around + b % around); };
  surface.polygon_offsets.push_back(0);
  for (int a = 0; a < along; ++a)
    for (int b = 0; b < around; ++b)
      for (const auto& t : {std::array{at(a, b), at(a + 1, b + 1), at(a + 1, b)},
                            {at(a, b), at(a, b + 1), at(a + 1, b + 1)}}) {
        surface.polygon_vertices.insert(surface.polygon_vertices.end(), t.begin(), t.end());
        surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
        surface.polygon_face.push_back(0);
      }
  surface.faces.push_back({"", 0});
  surface.parts.push_back({"knot"});
  surface.sources.emplace_back();
  surface.part_source.push_back(0);
  return surface;
}

}  // namespace flexel
