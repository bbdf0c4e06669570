// Linked with OpenVDB, and with nothing of ours.
#include "meshes/mesh_distances.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

namespace flexel::meshes {
namespace {

// A mesh as OpenVDB asks for it.
struct Mesh {
  const DistanceJob& job;
  [[nodiscard]] std::size_t polygonCount() const { return job.triangle_count; }
  [[nodiscard]] std::size_t pointCount() const { return job.point_count; }
  [[nodiscard]] std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t n, std::size_t v, openvdb::Vec3d& at) const {
    const double* point = job.points + 3 * std::size_t{job.corners[3 * n + v]};
    at = openvdb::Vec3d(point[0], point[1], point[2]);
  }
};

}  // namespace

std::shared_ptr<void> mesh_distances(const DistanceJob& job) {
  using openvdb::math::Transform;
  openvdb::initialize();
  const Transform::Ptr transform = job.transform == nullptr
                                       ? Transform::createLinearTransform(1)
                                       : Transform::createLinearTransform(openvdb::Mat4R(job.transform));
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      Mesh{job}, *transform, job.band, job.band, job.is_signed ? 0 : openvdb::tools::UNSIGNED_DISTANCE_FIELD);
}

}  // namespace flexel::meshes
