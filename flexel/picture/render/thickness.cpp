// One ray inward from the point asked for; for the range, from the middle of each triangle.
#include "flexel/picture/render/thickness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "base/program/share_scope.h"

namespace flexel::picture {

float thickness_at(const Tracer& tracer, const Vec3f& position, const Vec3f& normal) {
  constexpr float kSkip = 1e-5f;  // past the surface itself
  const Ray ray{position, -normal, kSkip, 1e30f};
  Hit hit;
  tracer.intersect({&ray, 1}, {&hit, 1});
  return hit.primitive == kNoHit ? std::numeric_limits<float>::quiet_NaN() : hit.t;
}

ThicknessRange thickness_range(const Drawable& drawn, const Tracer& tracer) {
  struct Found {
    float thickness, area;
  };
  std::vector<Found> found(drawn.triangles.size());
  constexpr std::size_t kTrianglesAtATime = 1024;
  ShareCounter done(found.size());
  parallel_chunks(found.size(), kTrianglesAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const auto& c = drawn.triangles[t];
      const Vec3f &p = drawn.vertices[c[0]], &q = drawn.vertices[c[1]], &r = drawn.vertices[c[2]];
      const Vec3f cross = (q - p).cross(r - p);
      const float area = cross.norm();
      found[t] = {area > 0 ? thickness_at(tracer, (p + q + r) / 3, cross / area)
                           : std::numeric_limits<float>::quiet_NaN(),
                  area};
    }
    done.add(end - begin);
  });
  std::erase_if(found, [](const Found& f) { return !std::isfinite(f.thickness); });
  if (found.empty()) return {};
  std::sort(found.begin(), found.end(),
            [](const Found& a, const Found& b) { return a.thickness < b.thickness; });
  double total = 0;
  for (const Found& f : found) total += f.area;
  const auto quantile = [&](double share) {
    double sum = 0;
    for (const Found& f : found)
      if ((sum += f.area) >= share * total) return f.thickness;
    return found.back().thickness;
  };
  const float largest = quantile(0.99);
  return {quantile(0.01), largest, std::min(largest, 2.5f * quantile(0.5))};
}

}  // namespace flexel::picture
