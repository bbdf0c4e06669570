// Rotates the normals that a file gives with the deformed surface. Inside flexel_formats only.
#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "base/math/area_vector.h"
#include "formats/common/surface_writers.h"

namespace flexel {

// What the polygons that use one normal did.
struct NormalChange {
  Vec3 rest = Vec3::Zero(), deformed = Vec3::Zero();  // summed area vectors
  bool moved = false;                                 // whether any of their vertices did
};

// The smallest rotation that takes the summed area vector from rest to the deformed state; nothing where the
// normal stays: nothing moved, or only along, or there is no area to tell.
[[nodiscard]] std::optional<Eigen::Quaterniond> turn(const NormalChange& change);

// For files with a normal per vertex: (vertices) from all polygons that use the vertex.
[[nodiscard]] std::vector<NormalChange> vertex_normal_changes(const DeformedSurface& deformed);

}  // namespace flexel
