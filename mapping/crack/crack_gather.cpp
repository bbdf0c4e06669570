// Collects cut triangles and whole polygons, and checks whether the result is closed.
#include <Eigen/Geometry>
#include <algorithm>

#include "mapping/crack/crack_pieces.h"

namespace flexel::mapping {
namespace {

// Twice the area of a triangle over the sum of its squared sides: 0 for a flat one, 1/sqrt(3) for a regular
// one.
double shape(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  const double squares = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return squares > 0 ? (b - a).cross(c - a).dot(normal) / squares : 0;
}

// Cuts ears off a convex polygon, which may have corners along a side, the best shaped first; never one that
// leaves a polygon without area.
void add_triangles(const CrackMesh& mesh, std::vector<std::uint32_t> corners, CrackPolygon like,
                   CrackPolygons& result) {
  Vec3 area = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
    area += (mesh.u(corners[k]) - mesh.u(corners[0])).cross(mesh.u(corners[k + 1]) - mesh.u(corners[0]));
  const Vec3 normal = area.normalized();
  double left = area.norm();
  const double flat = 1e-9 * left;
  const auto emit = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    like.begin = static_cast<std::uint32_t>(result.corners.size());
    like.end = like.begin + 3;
    result.corners.insert(result.corners.end(), {a, b, c});
    result.list.push_back(like);
  };
  while (corners.size() > 3) {
    const std::size_t n = corners.size();
    std::size_t best = 0;
    double best_shape = -2, best_area = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const Vec3 &a = mesh.u(corners[(k + n - 1) % n]), &b = mesh.u(corners[k]),
                 &c = mesh.u(corners[(k + 1) % n]);
      const double ear = (b - a).cross(c - a).dot(normal);
      const double quality = left - ear > flat ? shape(a, b, c, normal) : -1;
      if (quality > best_shape) best = k, best_shape = quality, best_area = ear;
    }
    emit(corners[(best + n - 1) % n], corners[best], corners[(best + 1) % n]);
    corners.erase(corners.begin() + static_cast<std::ptrdiff_t>(best));
    left -= best_area;
  }
  emit(corners[0], corners[1], corners[2]);
}

void add_whole_polygon(const Surface& surface, std::uint32_t p, const CrackPolygon& like,
                       CrackPolygons& result) {
  CrackPolygon polygon = like;
  const auto corners = surface.polygon(p);
  polygon.begin = static_cast<std::uint32_t>(result.corners.size());
  polygon.end = polygon.begin + static_cast<std::uint32_t>(corners.size());
  result.corners.insert(result.corners.end(), corners.begin(), corners.end());
  result.list.push_back(polygon);
}

}  // namespace

CrackPolygons gather_polygons(const Surface& surface, const CrackMesh& mesh,
                              const std::vector<std::uint32_t>& polygon_of,
                              const std::vector<CrackCap>& caps) {
  CrackPolygons result;
  const std::vector<CrackBit>& bits = mesh.bits();
  for (std::size_t begin = 0, end = 0; begin < bits.size(); begin = end) {
    const std::uint32_t p = polygon_of[bits[begin].triangle];
    bool whole = true;
    for (end = begin; end < bits.size() && polygon_of[bits[end].triangle] == p; ++end)
      whole = whole && !bits[end].changed && bits[end].fragment == bits[begin].fragment;
    if (whole) {
      BoxRange range = bits[begin].range;
      for (std::size_t b = begin; b < end; ++b)
        for (int a = 0; a < 3; ++a) {
          range.low[a] = std::min(range.low[a], bits[b].range.low[a]);
          range.high[a] = std::max(range.high[a], bits[b].range.high[a]);
        }
      add_whole_polygon(surface, p, {bits[begin].fragment, p, 0, 0, range}, result);
      continue;
    }
    for (std::size_t b = begin; b < end; ++b) {
      const auto corners = mesh.corners(bits[b]);
      add_triangles(mesh, {corners.begin(), corners.end()}, {bits[b].fragment, p, 0, 0, bits[b].range},
                    result);
    }
  }
  for (const CrackCap& cap : caps) {
    const auto begin = static_cast<std::uint32_t>(result.corners.size());
    result.corners.insert(result.corners.end(), cap.corners.begin(), cap.corners.end());
    result.list.push_back({cap.fragment, kNoPolygon, begin, begin + 3, {cap.box, cap.box}});
  }
  return result;
}

bool is_closed(const CrackMesh& mesh, const CrackPolygons& polygons) {
  struct Side {
    std::uint32_t fragment, low, high;
    int way;
  };
  std::vector<Side> sides;
  for (const CrackPolygon& polygon : polygons.list) {
    const auto corners = polygons.of(polygon);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const std::uint32_t a = mesh.welded(corners[k]), b = mesh.welded(corners[(k + 1) % corners.size()]);
      if (a != b) sides.push_back({polygon.fragment, std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  }
  const auto key = [](const Side& side) { return std::array{side.fragment, side.low, side.high}; };
  std::sort(sides.begin(), sides.end(), [&](const Side& a, const Side& b) { return key(a) < key(b); });
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    int sum = 0;
    for (end = begin; end < sides.size() && key(sides[end]) == key(sides[begin]); ++end)
      sum += sides[end].way;
    if (sum != 0) return false;
  }
  return true;
}

}  // namespace flexel::mapping
