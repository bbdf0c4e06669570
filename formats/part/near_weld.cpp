// Vertices of open edges are looked for in a grid with cells as wide as the tolerance. All others stay apart, or a needle
// narrower than the tolerance would be lost between neighbours that fit it exactly.
#include "formats/part/near_weld.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/math/weld.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

constexpr double kNear = 1e-7;  // of the part's diagonal, as the healer has it

std::vector<std::uint32_t> parts_of_vertices(const Surface& surface) {
  std::vector<std::uint32_t> part(surface.vertices.size(), 0);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    for (const std::uint32_t v : surface.polygon(p)) part[v] = surface.polygon_part(p);
  return part;
}

std::vector<std::uint32_t> weld_exactly(const Surface& surface, const std::vector<std::uint32_t>& part) {
  std::vector<std::uint32_t> welded = weld(surface.vertices);
  if (surface.parts.size() < 2) return welded;
  std::unordered_map<std::uint64_t, std::uint32_t> first;
  for (std::uint32_t v = 0; v < welded.size(); ++v)
    welded[v] = first.emplace(std::uint64_t{welded[v]} << 32 | part[v], v).first->second;
  return welded;
}

bool has_area(const std::array<std::uint32_t, 3>& corners, const std::vector<std::uint32_t>& welded) {
  const std::uint32_t a = welded[corners[0]], b = welded[corners[1]], c = welded[corners[2]];
  return a != b && b != c && c != a;
}

// Representatives on edges that not exactly two triangles have, ascending.
std::vector<std::uint32_t> at_unshared_edges(const Triangles& triangles, const Topology& topology,
                                             const std::vector<std::uint32_t>& welded) {
  std::vector<std::uint32_t> found;
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    const auto& corners = triangles.corners[t];
    if (!has_area(corners, welded)) continue;
    for (std::size_t i = 0; i < 3; ++i)
      if (topology.neighbour[t].at(i) == kNoTriangle)
        found.insert(found.end(), {welded[corners.at(i)], welded[corners.at((i + 1) % 3)]});
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

// Joins points of one part. Different cells may have one key: distances decide.
class NearPoints {
 public:
  NearPoints(const std::vector<Vec3>& points, double tolerance, const Vec3& base)
      : points_(points), tolerance_(tolerance), base_(base) {}

  // The first point so far that is near, or this one.
  std::uint32_t add(std::uint32_t v) {
    const Vec3 cell = (points_[v] - base_) / tolerance_;
    for (int n = 0; n < 27; ++n) {
      const auto found = cells_.find(key(cell + Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const std::uint32_t other : found->second)
        if ((points_[other] - points_[v]).squaredNorm() <= tolerance_ * tolerance_) return other;
    }
    cells_[key(cell)].push_back(v);
    return v;
  }

 private:
  static std::uint64_t key(const Vec3& cell) {
    return hash_key(position_key(std::floor(cell.x()), std::floor(cell.y()), std::floor(cell.z())));
  }

  const std::vector<Vec3>& points_;
  double tolerance_;
  Vec3 base_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace

std::vector<std::uint32_t> weld_parts(const Surface& surface, const Triangles& triangles) {
  const std::vector<std::uint32_t> part = parts_of_vertices(surface);
  std::vector<std::uint32_t> welded = weld_exactly(surface, part);
  const Topology found = topology(triangles.corners, welded);
  if (found.closed()) return welded;
  std::vector<Box> box(std::max<std::size_t>(surface.parts.size(), 1));
  for (const std::uint32_t v : surface.polygon_vertices) box[part[v]].add(surface.vertices[v]);
  std::unordered_map<std::uint32_t, NearPoints> points;
  std::vector<std::uint32_t> near(welded.size());
  for (std::uint32_t v = 0; v < near.size(); ++v) near[v] = v;
  for (const std::uint32_t v : at_unshared_edges(triangles, found, welded)) {
    const Box& own = box[part[v]];
    const double tolerance = kNear * own.diagonal();
    if (tolerance > 0 && std::isfinite(tolerance))
      near[v] = points.try_emplace(part[v], surface.vertices, tolerance, own.min).first->second.add(v);
  }
  for (std::uint32_t& v : welded) v = near[v];
  return welded;
}

std::vector<std::uint8_t> unshared_edges(const Surface& surface, const Triangles& triangles) {
  const std::vector<std::uint32_t> welded = weld_parts(surface, triangles);
  const Topology found = topology(triangles.corners, welded);
  std::vector<std::uint8_t> edges(triangles.corners.size(), 0);
  if (found.closed()) return edges;
  for (std::size_t t = 0; t < edges.size(); ++t)
    for (std::size_t i = 0; has_area(triangles.corners[t], welded) && i < 3; ++i)
      if (found.neighbour[t].at(i) == kNoTriangle) edges[t] |= static_cast<std::uint8_t>(1u << i);
  return edges;
}

}  // namespace flexel
