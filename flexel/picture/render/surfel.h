// The point of a drawable that a ray hit, with the data for shading.
#pragma once
#include "flexel/picture/render/drawable.h"

namespace flexel::picture {

struct Surfel {
  Vec3f position = Vec3f::Zero();
  Vec3f geometric = Vec3f::Zero();  // unit normal of the facet, towards the viewer
  Vec3f normal = Vec3f::Zero();     // unit, smooth, towards the viewer
  Vec3f lifted = Vec3f::Zero();     // the position moved onto the smooth shape that the facets approximate
  std::uint32_t part = 0;
  float value = 0;               // NaN where unknown
  Vec3f colour = Vec3f::Zero();  // where the drawable has colours of its own; sRGB
};

[[nodiscard]] Surfel surfel_at(const Drawable& drawn, const Ray& ray, const Hit& hit);

// Unit vectors that make a right-handed base with `normal`.
struct TangentBase {
  Vec3f x, y;
};
[[nodiscard]] TangentBase tangent_base(const Vec3f& normal);

}  // namespace flexel::picture
