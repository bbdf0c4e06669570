// A grid of OpenVDB's with the distances to triangles. Compiled once: the program flexel-meshes and the module
// flexel-distances.so link the object.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>

namespace flexel::meshes {

struct DistanceJob {
  const double* points;  // (point_count x 3), in the grid's index space; taken as float
  std::size_t point_count;
  const std::uint32_t* corners;  // (triangle_count x 3)
  std::size_t triangle_count;
  // Of the grid, index to metres: 4 x 4, rows as OpenVDB's; null: the index space itself
  const double* transform = nullptr;
  float band;             // voxels, on either side of the surface
  bool is_signed = true;  // negative for what a flood from outside does not reach; else never negative
};
// An openvdb::FloatGrid. Throws std::bad_alloc.
[[nodiscard]] std::shared_ptr<void> mesh_distances(const DistanceJob& job);

}  // namespace flexel::meshes
