// Linked with OpenVDB, and with nothing of ours. Of meshToVolume the library has the code for points of single precision and
// triangles; any other takes most of a minute to compile.
#include "meshes/mesh_distances.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <vector>

namespace flexel::meshes {

std::shared_ptr<void> mesh_distances(const DistanceJob& job) {
  using openvdb::math::Transform;
  openvdb::initialize();
  const Transform::Ptr transform = job.transform == nullptr
                                       ? Transform::createLinearTransform(1)
                                       : Transform::createLinearTransform(openvdb::Mat4R(job.transform));
  std::vector<openvdb::Vec3s> points(job.point_count);
  for (std::size_t v = 0; v < points.size(); ++v) points[v] = openvdb::Vec3s(job.points + 3 * v);
  std::vector<openvdb::Vec3I> triangles(job.triangle_count);
  for (std::size_t t = 0; t < triangles.size(); ++t) triangles[t] = openvdb::Vec3I(job.corners + 3 * t);
  openvdb::util::NullInterrupter goes_on;
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points, triangles);
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      goes_on, mesh, *transform, job.band, job.band,
      job.is_signed ? 0 : openvdb::tools::UNSIGNED_DISTANCE_FIELD);
}

}  // namespace flexel::meshes
