// How normals that a file gives turn with the surface. Inside flexel_formats only.
#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "formats/surface_writers.h"

namespace flexel {

// What the polygons that use one normal did.
struct NormalChange {
  Vec3 rest = Vec3::Zero(), deformed = Vec3::Zero();  // summed area vectors, doubled
  bool moved = false;                                 // whether any of their vertices did
};

// Area vector of a polygon of n corners, doubled (Newell). at(i): position of corner i.
template <class At>
[[nodiscard]] Vec3 area_vector(std::size_t n, const At& at) {
  Vec3 area = Vec3::Zero();
  const Vec3 origin = at(0);
  for (std::size_t i = 1; i + 1 < n; ++i) area += (at(i) - origin).cross(at(i + 1) - origin);
  return area;
}

// The smallest rotation that takes the summed area vector from rest to the deformed state; nothing where the
// normal stays: nothing moved, or only along, or there is no area to tell.
[[nodiscard]] std::optional<Eigen::Quaterniond> turn(const NormalChange& change);

// For files with a normal per vertex: (vertices) from all polygons that use the vertex.
[[nodiscard]] std::vector<NormalChange> vertex_normal_changes(const DeformedSurface& deformed);

}  // namespace flexel
