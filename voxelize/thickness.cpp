// One ray from each corner of each triangle; the least over the triangles at a vertex. Rays are exact, where
// a distance grid fine enough for the same accuracy on a thin wall would have hundreds of millions of voxels.
#include "voxelize/thickness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/program/share_scope.h"
#include "voxelize/heal/heal.h"
#include "voxelize/heal/heal_cgal.h"

namespace flexel::voxelize {
namespace {

constexpr double kInside = .05;     // of the way from the corner to the triangle's centroid
constexpr double kOpposed = -.866;  // cosine of 150 degrees
constexpr double kNone = std::numeric_limits<double>::infinity();

struct Least {
  double opposed = kNone, any = kNone;
};

// The least way from each vertex of the mesh.
std::vector<Least> least_ways(const PartMesh& mesh) {
  std::vector<Least> least(mesh.world.size());
  const RayCaster rays(mesh);
  constexpr std::uint32_t kTrianglesAtATime = 1024;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    if (t % kTrianglesAtATime == 0) tell_share(t / static_cast<double>(mesh.corners.size()));
    const Corners& c = mesh.corners[t];
    const Vec3 normal = unit_normal(mesh, t),
               middle = (mesh.world[c[0]] + mesh.world[c[1]] + mesh.world[c[2]]) / 3;
    if (!(normal.squaredNorm() > .5)) continue;
    for (const std::uint32_t v : c) {
      const auto hit = rays.first(mesh.world[v] + kInside * (middle - mesh.world[v]), -normal, t);
      if (!hit) continue;
      least[v].any = std::min(least[v].any, hit->distance);
      if (normal.dot(unit_normal(mesh, hit->triangle)) < kOpposed)
        least[v].opposed = std::min(least[v].opposed, hit->distance);
    }
  }
  return least;
}

}  // namespace

std::vector<double> vertex_thickness(const Surface& surface) {
  std::map<std::array<double, 3>, double> at;  // by position: healing welds, the surface does not
  std::vector<PartMesh> meshes = exact_part_meshes(surface);
  const auto parts = static_cast<double>(meshes.size());
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    PartMesh& mesh = meshes[p];
    if (mesh.corners.empty()) continue;
    const ShareScope scope(static_cast<double>(p) / parts, static_cast<double>(p + 1) / parts);
    const HealedPart part = heal(std::move(mesh), {}, "");
    const std::vector<Least> least = least_ways(part.mesh);
    for (std::size_t v = 0; v < least.size(); ++v) {
      const Vec3& x = part.mesh.world[v];
      const double way = least[v].opposed < kNone ? least[v].opposed : least[v].any;
      double& known = at.try_emplace({x.x(), x.y(), x.z()}, kNone).first->second;
      known = std::min(known, way);
    }
  }
  std::vector<double> thickness;
  thickness.reserve(surface.vertices.size());
  for (const Vec3& p : surface.vertices) {
    const auto found = at.find({p.x(), p.y(), p.z()});
    thickness.push_back(found == at.end() || found->second == kNone ? std::numeric_limits<double>::quiet_NaN()
                                                                    : found->second);
  }
  return thickness;
}

}  // namespace flexel::voxelize
