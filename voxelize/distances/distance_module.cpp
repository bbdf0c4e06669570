// Linked with OpenVDB, and with nothing of ours. OpenVDB's voxels are samples: index (x, y, z) is a point.
#include "voxelize/distances/distance_module.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

namespace {

// A mesh as OpenVDB asks for it, in its index space.
struct Mesh {
  const double* points;
  std::size_t point_count;
  const std::uint32_t* corners;
  std::size_t triangle_count;
  [[nodiscard]] std::size_t polygonCount() const { return triangle_count; }
  [[nodiscard]] std::size_t pointCount() const { return point_count; }
  [[nodiscard]] std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t n, std::size_t v, openvdb::Vec3d& at) const {
    const double* point = points + 3 * std::size_t{corners[3 * n + v]};
    at = openvdb::Vec3d(point[0], point[1], point[2]);
  }
};

using Grid = openvdb::FloatGrid::Ptr;

void* create(const double* points, std::size_t point_count, const std::uint32_t* corners,
             std::size_t triangle_count, float band) {
  try {
    openvdb::initialize();
    const auto transform = openvdb::math::Transform::createLinearTransform(1);
    return new Grid(openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        Mesh{points, point_count, corners, triangle_count}, *transform, band, band));
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
