// Where healing closed the surface, each polygon takes the orientation of its healed triangles. Where the
// surface stayed open, regions of consistent orientation are turned by ray casting: matter lies on the side
// of a triangle on which a ray crosses the surface an odd number of times. For a wrapped part, the outside is
// the side on which the wrap is nearer.
#include "voxelize/heal/outward.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "base/math/area_vector.h"
#include "base/stop.h"
#include "voxelize/heal/heal_cgal.h"
#include "voxelize/heal/heal_mesh.h"

namespace flexel::voxelize {
namespace {

constexpr std::size_t kAsked = 64;    // triangles of a region, about
constexpr int kMostCrossings = 1000;  // of a ray

Vec3 area_of(const PartMesh& mesh, std::uint32_t t) {
  const Corners& c = mesh.corners[t];
  return (mesh.world[c[1]] - mesh.world[c[0]]).cross(mesh.world[c[2]] - mesh.world[c[0]]) / 2;
}

// 1 where matter lies behind triangle t (it faces outward), -1 where it lies in front, 0 where rays do not
// tell.
using Judge = int (*)(const RayCaster& rays, const PartMesh& mesh, std::uint32_t t);

struct Ray {
  Vec3 from = Vec3::Zero(), direction = Vec3::Zero();
};

// From the centroid to the front, a little off the normal: across symmetric parts that would meet edges.
Ray ray_from(const PartMesh& mesh, std::uint32_t t) {
  constexpr double kTilt = .01, kTiltAcross = .007;
  const Corners& c = mesh.corners[t];
  const Vec3 normal = unit_normal(mesh, t), along = (mesh.world[c[1]] - mesh.world[c[0]]).normalized();
  return {(mesh.world[c[0]] + mesh.world[c[1]] + mesh.world[c[2]]) / 3,
          (normal + kTilt * along + kTiltAcross * normal.cross(along)).normalized()};
}

bool odd_crossings(const RayCaster& rays, Vec3 from, const Vec3& direction, std::uint32_t own) {
  int count = 0;
  for (; count < kMostCrossings; ++count) {
    const auto hit = rays.first(from, direction, own);
    if (!hit) break;
    from += hit->distance * direction;
    own = hit->triangle;
  }
  return count % 2 != 0;
}

int judge_by_crossings(const RayCaster& rays, const PartMesh& mesh, std::uint32_t t) {
  const auto [from, direction] = ray_from(mesh, t);
  const bool front = odd_crossings(rays, from, direction, t), back = odd_crossings(rays, from, -direction, t);
  return static_cast<int>(back) - static_cast<int>(front);
}

int judge_by_wrap(const RayCaster& wrap, const PartMesh& mesh, std::uint32_t t) {
  const auto [from, direction] = ray_from(mesh, t);
  const auto front = wrap.first(from, direction, kNoPolygon), back = wrap.first(from, -direction, kNoPolygon);
  if (!front || !back) return 0;
  return front->distance < back->distance ? 1 : front->distance > back->distance ? -1 : 0;
}

// Whether to turn each triangle of `mesh`, whose regions are turned as `judge` says.
std::vector<std::uint8_t> judged_turns(const PartMesh& mesh, const RayCaster& rays, Judge judge) {
  FacingRegions regions = facing_regions(mesh);
  std::vector<std::size_t> size(regions.count, 0), seen(regions.count, 0);
  for (const std::uint32_t region : regions.region) ++size[region];
  std::vector<double> outward(regions.count, 0);  // m^2
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) {
    const std::uint32_t region = regions.region[t];
    const double area = triangle_area(mesh, t);
    if (seen[region]++ % (size[region] / kAsked + 1) != 0 || !(area > 0)) continue;
    check_stop();
    outward[region] += (regions.turn[t] ? -1 : 1) * judge(rays, mesh, t) * area;
  }
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    if (outward[regions.region[t]] < 0) regions.turn[t] ^= 1;
  return regions.turn;
}

// Sum of the area vectors of each polygon's triangles as they face when `turn` (none: as they are) is done.
void add_areas(const PartMesh& mesh, const std::vector<std::uint8_t>& turn, std::vector<Vec3>& outward) {
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    if (mesh.polygon[t] != kNoPolygon)
      outward[mesh.polygon[t]] += (!turn.empty() && turn[t] ? -1. : 1.) * area_of(mesh, t);
}

// Facets that healing left out because they repeat others face as those do.
void add_repeated(const HealedPart& part, std::vector<Vec3>& outward) {
  if (part.done.duplicate_facets == 0) return;
  const auto key = [](const PartMesh& mesh, std::uint32_t t) {
    std::array<std::array<double, 3>, 3> corners;
    for (int c = 0; c < 3; ++c)
      for (int axis = 0; axis < 3; ++axis) corners[c][axis] = mesh.world[mesh.corners[t][c]][axis];
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::map<std::array<std::array<double, 3>, 3>, Vec3> kept;
  for (std::uint32_t t = 0; t < part.mesh.corners.size(); ++t)
    kept.try_emplace(key(part.mesh, t), area_of(part.mesh, t));
  for (std::uint32_t t = 0; t < part.original.corners.size(); ++t) {
    Vec3& area = outward[part.original.polygon[t]];
    if (area != Vec3::Zero()) continue;
    if (const auto found = kept.find(key(part.original, t)); found != kept.end()) area = found->second;
  }
}

void add_outward(HealedPart& part, std::vector<Vec3>& outward) {
  if (part.mesh.corners.empty()) return;
  const auto judge = [&](const PartMesh& mesh, const RayCaster& rays, Judge by) {
    const std::vector<std::uint8_t> turn = judged_turns(mesh, rays, by);
    part.done.flipped_facets = static_cast<std::size_t>(std::count(turn.begin(), turn.end(), 1));
    part.done.inverted_shells = 0;
    add_areas(mesh, turn, outward);
  };
  if (part.done.wrapped) {
    judge(part.original, RayCaster(part.mesh), judge_by_wrap);
  } else if (!part.mesh.balanced()) {
    judge(part.mesh, RayCaster(part.mesh), judge_by_crossings);
  } else {
    add_areas(part.mesh, {}, outward);
    add_repeated(part, outward);
  }
}

}  // namespace

void face_outward(std::vector<HealedPart>& parts, Surface& surface) {
  std::vector<Vec3> outward(surface.polygon_count(), Vec3::Zero());  // (polygons) m^2
  for (HealedPart& part : parts) add_outward(part, outward);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (outward[p].dot(area_vector(surface.vertices, surface.polygon(p))) < 0)
      std::reverse(surface.polygon_vertices.begin() + surface.polygon_offsets[p] + 1,
                   surface.polygon_vertices.begin() + surface.polygon_offsets[p + 1]);
}

}  // namespace flexel::voxelize
