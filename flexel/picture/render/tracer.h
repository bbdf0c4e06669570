// Rays against what is drawn. All use of Embree is in tracer.cpp.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace flexel::picture {

using Vec3f = Eigen::Vector3f;

constexpr std::uint32_t kNoHit = 0xffffffffu;

// Points origin + t direction, near <= t <= far.
struct Ray {
  Vec3f origin = Vec3f::Zero(), direction = Vec3f::Zero();
  float near = 0, far = 1e30f;
};

// The first thing that a ray meets.
struct Hit {
  std::uint32_t primitive = kNoHit;  // triangle, or sphere
  float t = 1e30f;
  float u = 0, v = 0;  // barycentric weights of the triangle's corners 1 and 2
};

// Triangles, or spheres where there are no triangles. Immutable, so that any number of threads may ask.
class Tracer {
 public:
  Tracer(const std::vector<Vec3f>& vertices, const std::vector<std::array<std::uint32_t, 3>>& triangles);
  // A sphere is (x, y, z, radius).
  explicit Tracer(const std::vector<Eigen::Vector4f>& spheres);
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  // hits[i] is what rays[i] meets first. Rays that run side by side should be neighbours in the list.
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const;
  // blocked[i] is 1 where rays[i] meets anything.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace flexel::picture
