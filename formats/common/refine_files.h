// Files whose polygons were split: the bytes that a surface came from, with the same vertices first, new ones after them,
// and each polygon replaced by its pieces. Everything else stays word by word. Inside flexel_formats only.
#pragma once
#include <string>

#include "formats/part/refinement.h"

namespace flexel {

// Each changes source.bytes, in the rest state and the file's unit. What vertices and corners have is interpolated:
// positions, texture coordinates, colours and other numbers by their mean, normals by that and their length. Returns
// what the file holds that cannot be split, and leaves it as it was; "" where all went well.
[[nodiscard]] std::string refine_obj(SurfaceSource& source, const Refinement& refinement);
[[nodiscard]] std::string refine_ply(SurfaceSource& source, const Refinement& refinement);
[[nodiscard]] std::string refine_off(SurfaceSource& source, const Refinement& refinement);
[[nodiscard]] std::string refine_glb(SurfaceSource& source, const Refinement& refinement);
[[nodiscard]] std::string refine_3mf(SurfaceSource& source, const Refinement& refinement);

// Half-way between two normals: as long as their mean; the first where they are opposite.
[[nodiscard]] inline Vec3 mean_normal(const Vec3& a, const Vec3& b) {
  const Vec3 sum = a + b;
  const double length = 0.5 * (a.norm() + b.norm());
  return sum.norm() > 1e-9 * length ? Vec3(sum * (length / sum.norm())) : a;
}

}  // namespace flexel
