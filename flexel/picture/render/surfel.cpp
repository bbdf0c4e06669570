// Interpolation in a triangle, and points of spheres.
#include "flexel/picture/render/surfel.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace flexel::picture {
namespace {

Surfel on_sphere(const Drawable& drawn, const Ray& ray, const Hit& hit) {
  Surfel at;
  at.position = at.lifted = ray.origin + hit.t * ray.direction;
  at.geometric = at.normal = (at.position - drawn.spheres[hit.primitive].head<3>()).normalized();
  return at;
}

// A smooth normal may look away from the viewer where the facet does not: it is turned until it is square to
// the line of sight.
Vec3f facing(const Vec3f& smooth, const Vec3f& geometric, const Vec3f& towards_viewer) {
  Vec3f normal = smooth.dot(geometric) < 0 ? Vec3f(-smooth) : smooth;
  const float cosine = normal.dot(towards_viewer);
  if (cosine < 0.01f) normal += (0.01f - cosine) * towards_viewer;
  const float length = normal.norm();
  return length > 0 ? Vec3f(normal / length) : geometric;
}

Surfel on_triangle(const Drawable& drawn, const Ray& ray, const Hit& hit) {
  const auto& corners = drawn.triangles[hit.primitive];
  const std::array<float, 3> weight{1 - hit.u - hit.v, hit.u, hit.v};
  const std::array<Vec3f, 3> p{drawn.vertices[corners[0]], drawn.vertices[corners[1]],
                               drawn.vertices[corners[2]]};
  Surfel at;
  at.position = weight[0] * p[0] + weight[1] * p[1] + weight[2] * p[2];
  at.geometric = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  const bool from_behind = at.geometric.dot(ray.direction) > 0;
  if (from_behind) at.geometric = -at.geometric;
  Vec3f smooth = Vec3f::Zero(), lift = Vec3f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f normal =
        from_behind ? Vec3f(-drawn.normals[hit.primitive][i]) : drawn.normals[hit.primitive][i];
    smooth += weight[i] * normal;
    // J. Hanika, "Hacking the shadow terminator" (Ray Tracing Gems II, 2021): out to the corners' tangent
    // planes.
    lift -= weight[i] * std::min(0.0f, (at.position - p[i]).dot(normal)) * normal;
  }
  at.lifted = at.position + lift;
  at.normal = facing(smooth, at.geometric, -ray.direction);
  return at;
}

// What `values` says of the point; `none` where there are no values.
template <class Value>
Value value_at(const Drawable& drawn, const Hit& hit, Drawable::ValuesAt at, const std::vector<Value>& values,
               const Value& none) {
  if (at == Drawable::ValuesAt::primitives) return values[hit.primitive];
  if (at != Drawable::ValuesAt::vertices) return none;
  const auto& c = drawn.triangles[hit.primitive];
  return (1 - hit.u - hit.v) * values[c[0]] + hit.u * values[c[1]] + hit.v * values[c[2]];
}

}  // namespace

Surfel surfel_at(const Drawable& drawn, const Ray& ray, const Hit& hit) {
  Surfel at = drawn.triangles.empty() ? on_sphere(drawn, ray, hit) : on_triangle(drawn, ray, hit);
  at.part = drawn.part[hit.primitive];
  at.value = value_at(drawn, hit, drawn.values_at, drawn.values, 0.0f);
  at.colour = value_at<Vec3f>(drawn, hit, drawn.colours_at, drawn.colours, Vec3f::Zero());
  return at;
}

// T. Duff et al., "Building an orthonormal basis, revisited" (JCGT 6(1), 2017).
TangentBase tangent_base(const Vec3f& n) {
  const float sign = std::copysign(1.0f, n.z());
  const float a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
  return {Vec3f(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()),
          Vec3f(b, sign + n.y() * n.y() * a, -n.y())};
}

}  // namespace flexel::picture
