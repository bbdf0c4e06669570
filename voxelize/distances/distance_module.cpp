// Linked with OpenVDB and mesh_distances.cpp. OpenVDB's voxels are samples: index (x, y, z) is a point.
#include "voxelize/distances/distance_module.h"

#include <openvdb/openvdb.h>

#include "meshes/mesh_distances.h"

namespace {

using Grid = openvdb::FloatGrid::Ptr;

void* create(const double* points, std::size_t point_count, const std::uint32_t* corners,
             std::size_t triangle_count, float band) {
  try {
    const flexel::meshes::DistanceJob job = {.points = points,
                                             .point_count = point_count,
                                             .corners = corners,
                                             .triangle_count = triangle_count,
                                             .band = band};
    return new Grid(std::static_pointer_cast<openvdb::FloatGrid>(flexel::meshes::mesh_distances(job)));
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

void destroy(void* distances) {
  delete static_cast<Grid*>(distances);
}

void read(const void* distances, int x, int y, int z, int size, float* out) {
  const auto reader = (*static_cast<const Grid*>(distances))->getConstUnsafeAccessor();
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) *out++ = reader.getValue({x + i, y + j, z + k});
}

}  // namespace

const FlexelDistanceModule* FLEXEL_DISTANCE_MODULE() {
  static const FlexelDistanceModule kModule = {create, destroy, read};
  return &kModule;
}
