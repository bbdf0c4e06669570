// Each candidate is judged by a few thousand rays.
#include "flexel/picture/render/best_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/program/share_scope.h"

namespace flexel::picture {
namespace {

constexpr int kAcross = 72, kDown = 54;

// Entropy, in nats, of the shares of the picture that the faces take up, the background being one of them.
double entropy(const Drawable& drawn, const std::vector<Hit>& hits) {
  std::vector<std::uint32_t> seen;
  for (const Hit& hit : hits)
    seen.push_back(hit.primitive == kNoHit ? kNoHit
                   : drawn.face.empty()    ? drawn.part[hit.primitive]
                                           : drawn.face[hit.primitive]);
  std::sort(seen.begin(), seen.end());
  double sum = 0;
  for (std::size_t i = 0; i < seen.size();) {
    std::size_t stop = i;
    while (stop < seen.size() && seen[stop] == seen[i]) ++stop;
    const double share = static_cast<double>(stop - i) / static_cast<double>(seen.size());
    sum -= share * std::log(share);
    i = stop;
  }
  return sum;
}

// Points of the surface, evenly spread by area, with their normals.
struct Probe {
  Vec3f point, normal;
};

std::vector<Probe> probes(const Drawable& drawn) {
  constexpr double kProbes = 1500;
  std::vector<Probe> result;
  double total = 0, sum = 0;
  std::vector<float> area(drawn.triangles.size());
  const auto corner = [&](std::size_t t, std::size_t i) -> const Vec3f& {
    return drawn.vertices[drawn.triangles[t][i]];
  };
  for (std::size_t t = 0; t < area.size(); ++t) {
    area[t] = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
    total += area[t];
  }
  for (std::size_t t = 0; t < area.size() && total > 0; ++t) {
    const double before = std::floor(sum * kProbes / total);
    sum += area[t];
    const int here = static_cast<int>(std::floor(sum * kProbes / total) - before);
    const Vec3f normal = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).normalized();
    for (int k = 0; k < here; ++k) {
      // Spread over the triangle by the R2 sequence, folded into it.
      float u = std::fmod(0.5f + 0.7548777f * static_cast<float>(k), 1.0f),
            v = std::fmod(0.5f + 0.5698403f * static_cast<float>(k), 1.0f);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      result.push_back({(1 - u - v) * corner(t, 0) + u * corner(t, 1) + v * corner(t, 2), normal});
    }
  }
  return result;
}

// The share of what faces the camera that nothing hides.
double openness(const std::vector<Probe>& points, const Tracer& tracer, const Camera& camera) {
  constexpr float kLift = 1e-3f;
  std::vector<Ray> rays;
  for (const Probe& probe : points)
    if (probe.normal.dot(camera.forward) < -0.05f)
      rays.push_back({probe.point + kLift * probe.normal, -camera.forward, 0, 1e30f});
  if (rays.empty()) return 1;
  std::vector<std::uint8_t> hidden(rays.size());
  tracer.occluded(rays, hidden);
  return 1 -
         static_cast<double>(std::count(hidden.begin(), hidden.end(), 1)) / static_cast<double>(rays.size());
}

double score(const ViewSubject& subject, const std::vector<Probe>& points, const View& view, double aspect) {
  Camera camera = camera_towards(view);
  const Drawable& drawn = *subject.drawn;
  std::vector<Vec3f> centres;
  for (const Eigen::Vector4f& sphere : drawn.spheres) centres.push_back(sphere.head<3>());
  const Eigen::Vector4f box = extent(camera, drawn.triangles.empty() ? centres : drawn.vertices);
  const double width = std::max(1e-6f, box[2] - box[0]), height = std::max(1e-6f, box[3] - box[1]);
  const double half = std::max(width / aspect, height) / 2;  // of the frame's height
  camera.pixels = static_cast<float>(kDown / (2 * half));
  camera.x = kAcross / 2.0f - camera.pixels * (box[0] + box[2]) / 2;
  camera.y = kDown / 2.0f + camera.pixels * (box[1] + box[3]) / 2;
  std::vector<Ray> rays;
  for (int y = 0; y < kDown; ++y)
    for (int x = 0; x < kAcross; ++x)
      rays.push_back(camera.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
  std::vector<Hit> hits(rays.size());
  subject.tracer->intersect(rays, hits);
  const double total = subject.motion.trace();
  const Vec3 sight = camera.forward.cast<double>();
  const double across = total > 0 ? 1 - sight.dot(subject.motion * sight) / total : 1;
  return (0.2 + entropy(drawn, hits)) * (0.4 + 0.6 * openness(points, *subject.tracer, camera)) *
         (0.35 + 0.65 * std::sqrt(std::clamp(across, 0.0, 1.0)));
}

struct Candidate {
  View view;
  double preference;
};

std::vector<Candidate> candidates(Up up) {
  std::vector<Candidate> all;
  for (const double elevation : {25.0, 35.0, 50.0})
    for (const double azimuth : {35.0, -35.0, 60.0, -60.0, 145.0, -145.0, 120.0, -120.0}) {
      const double side = std::abs(azimuth) > 90 ? 0.8 : azimuth > 0 ? 1.0 : 0.87;
      all.push_back({{azimuth, elevation, up}, side * (elevation > 40 ? 0.96 : 1.0)});
    }
  return all;
}

}  // namespace

View best_view(const std::vector<ViewSubject>& subjects, double aspect, Up up) {
  const std::vector<Candidate> all = candidates(up);
  std::vector<double> scores(all.size(), 0);
  std::vector<std::vector<Probe>> points;
  for (const ViewSubject& subject : subjects) points.push_back(probes(*subject.drawn));
  ShareCounter done(all.size());
  parallel_for_each(
      all.size(),
      [&](std::size_t i) {
        for (std::size_t k = 0; k < subjects.size(); ++k)
          scores[i] += all[i].preference * score(subjects[k], points[k], all[i].view, aspect);
        done.add(1);
      },
      1);
  return all[static_cast<std::size_t>(std::max_element(scores.begin(), scores.end()) - scores.begin())].view;
}

}  // namespace flexel::picture
