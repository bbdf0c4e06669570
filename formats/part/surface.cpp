// A polygon is cut into triangles in the plane of its area vector (Newell): a strictly convex one as a fan
// from its first corner, any other by clipping ears. Polygon p of n corners gives triangles [offsets[p] - 2
// p, ...), so all are cut in parallel.
#include "formats/part/surface.h"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/math/area_vector.h"
#include "base/parallel.h"

namespace flexel {
namespace {

using Corners = std::array<std::uint32_t, 3>;

// The polygon's corners in its own plane.
using Outline = std::vector<Eigen::Vector2d>;

Outline flatten(const Surface& surface, std::span<const std::uint32_t> polygon) {
  const Vec3 origin = surface.vertices[polygon[0]];
  const Vec3 area = area_vector(surface.vertices, polygon);
  // Dropping the largest component of the area vector keeps every orientation without a rotation's rounding.
  Eigen::Index dropped = 0;
  area.cwiseAbs().maxCoeff(&dropped);
  const Eigen::Index u = (dropped + 1) % 3, v = (dropped + 2) % 3;
  const double sign = area[dropped] < 0 ? -1 : 1;
  Outline outline;
  outline.reserve(polygon.size());
  for (const std::uint32_t vertex : polygon) {
    const Vec3 at = surface.vertices[vertex] - origin;
    outline.emplace_back(at[u], sign * at[v]);
  }
  return outline;
}

// Twice the signed area of a triangle; positive when it turns left.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const Eigen::Vector2d p = b - a, q = c - a;
  return p.x() * q.y() - p.y() * q.x();
}

// Every corner turns left, and seen from the first corner the others follow one another: no star.
bool strictly_convex(const Outline& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i)
    if (turn(outline[i], outline[(i + 1) % n], outline[(i + 2) % n]) <= 0) return false;
  for (std::size_t i = 1; i + 1 < n; ++i)
    if (turn(outline[0], outline[i], outline[i + 1]) <= 0) return false;
  return true;
}

// An ear turns left and holds no other corner.
bool is_ear(const Outline& outline, const std::vector<std::size_t>& ring, std::size_t at) {
  const std::size_t n = ring.size(), before = (at + n - 1) % n, after = (at + 1) % n;
  const Eigen::Vector2d &a = outline[ring[before]], &b = outline[ring[at]], &c = outline[ring[after]];
  if (turn(a, b, c) <= 0) return false;
  for (std::size_t k = 0; k < n; ++k) {
    if (k == before || k == at || k == after) continue;
    const Eigen::Vector2d& p = outline[ring[k]];
    if (p == a || p == b || p == c) continue;
    if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
  }
  return true;
}

// The corner to clip next: the first ear, searched from where the last one was clipped; where there is none
// (a polygon that crosses itself, or without area) the corner that turns left the most.
std::size_t next_ear(const Outline& outline, const std::vector<std::size_t>& ring, std::size_t start) {
  const std::size_t n = ring.size();
  for (std::size_t k = 0; k < n; ++k)
    if (is_ear(outline, ring, (start + k) % n)) return (start + k) % n;
  std::size_t best = 0;
  double most = -1e300;
  for (std::size_t k = 0; k < n; ++k) {
    const double left = turn(outline[ring[(k + n - 1) % n]], outline[ring[k]], outline[ring[(k + 1) % n]]);
    if (left > most) {
      most = left;
      best = k;
    }
  }
  return best;
}

void clip_ears(const Outline& outline, std::span<const std::uint32_t> polygon, Corners* out) {
  std::vector<std::size_t> ring(polygon.size());
  for (std::size_t i = 0; i < ring.size(); ++i) ring[i] = i;
  std::size_t start = 1;
  while (ring.size() > 2) {
    const std::size_t n = ring.size();
    const std::size_t ear = n == 3 ? 1 : next_ear(outline, ring, start % n);
    *out++ = {polygon[ring[(ear + n - 1) % n]], polygon[ring[ear]], polygon[ring[(ear + 1) % n]]};
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
    start = ear;
  }
}

void cut(const Surface& surface, std::size_t p, Corners* out) {
  const auto polygon = surface.polygon(p);
  if (polygon.size() == 3) {
    *out = {polygon[0], polygon[1], polygon[2]};
    return;
  }
  const Outline outline = flatten(surface, polygon);
  if (!strictly_convex(outline)) {
    clip_ears(outline, polygon, out);
    return;
  }
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) *out++ = {polygon[0], polygon[i], polygon[i + 1]};
}

void check_tables(const Surface& surface, const std::string& where) {
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw InputError(where, fmt::format("the surface is damaged: {}", what));
  };
  const std::size_t polygons = surface.polygon_count();
  if (polygons == 0) throw InputError(where, "holds no polygons: nothing to work on");
  require(surface.polygon_offsets.front() == 0, "polygon_offsets does not begin with 0");
  require(surface.polygon_offsets.back() == surface.polygon_vertices.size(),
          "polygon_offsets does not end at the size of polygon_vertices");
  require(surface.polygon_face.size() == polygons, "polygon_face does not have an entry per polygon");
  require(surface.part_source.size() == surface.parts.size(), "part_source does not have an entry per part");
  for (const SurfaceFace& face : surface.faces)
    require(face.part < surface.parts.size(), "a face names a part that does not exist");
  for (const std::uint32_t source : surface.part_source)
    require(source < surface.sources.size(), "a part names a source that does not exist");
}

void check_polygons(const Surface& surface, const std::string& where) {
  constexpr std::uint32_t kNoPart = 0xffffffffu;
  std::vector<std::uint32_t> vertex_part(surface.vertices.size(), kNoPart);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const std::uint32_t begin = surface.polygon_offsets[p], end = surface.polygon_offsets[p + 1];
    if (end < begin || end > surface.polygon_vertices.size() || end - begin < 3)
      throw InputError(where, fmt::format("polygon {} has fewer than three corners", p + 1));
    if (surface.polygon_face[p] >= surface.faces.size())
      throw InputError(where, fmt::format("polygon {} names a face that does not exist", p + 1));
    const std::uint32_t part = surface.polygon_part(p);
    for (const std::uint32_t vertex : surface.polygon(p)) {
      if (vertex >= surface.vertices.size())
        throw InputError(where, fmt::format("polygon {} names vertex {}, but there are only {}", p + 1,
                                            std::uint64_t{vertex} + 1, surface.vertices.size()));
      if (vertex_part[vertex] != kNoPart && vertex_part[vertex] != part)
        throw InputError(where, fmt::format("vertex {} belongs to two parts", vertex + 1));
      vertex_part[vertex] = part;
    }
  }
}

}  // namespace

Triangles triangulate(const Surface& surface) {
  const std::size_t polygons = surface.polygon_count();
  Triangles triangles;
  if (polygons == 0) return triangles;
  triangles.corners.resize(surface.polygon_offsets.back() - 2 * polygons);
  triangles.polygon.resize(triangles.corners.size());
  parallel_for_each(polygons, [&](std::size_t p) {
    const std::size_t first = surface.polygon_offsets[p] - 2 * p,
                      last = surface.polygon_offsets[p + 1] - 2 * (p + 1);
    cut(surface, p, &triangles.corners[first]);
    for (std::size_t t = first; t < last; ++t) triangles.polygon[t] = static_cast<std::uint32_t>(p);
  });
  return triangles;
}

void check(const Surface& surface, const std::string& where) {
  check_tables(surface, where);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    if (!surface.vertices[v].allFinite())
      throw InputError(where, fmt::format("vertex {} is not finite", v + 1));
    if (surface.vertices[v].cwiseAbs().maxCoeff() > kLargestCoordinate)
      throw InputError(
          where, fmt::format("vertex {} lies beyond {} m: is the file damaged?", v + 1, kLargestCoordinate));
  }
  check_polygons(surface, where);
  check_columns(surface.vertex_columns, surface.vertices.size(), "vertex_columns", where);
  check_columns(surface.polygon_columns, surface.polygon_count(), "polygon_columns", where);
}

std::vector<std::uint32_t> face_numbers(const Surface& surface) {
  std::vector<std::uint32_t> next(surface.parts.size(), 0), numbers;
  numbers.reserve(surface.faces.size());
  for (const SurfaceFace& face : surface.faces) numbers.push_back(++next[face.part]);
  return numbers;
}

void make_part_names_unique(Surface& surface, const std::string& fallback) {
  std::set<std::string> all, used;
  std::map<std::string, std::size_t> next;  // number to try, of a name that is taken
  for (SurfacePart& part : surface.parts) {
    if (part.name.empty()) part.name = fallback;
    all.insert(part.name);
  }
  for (SurfacePart& part : surface.parts) {
    const std::string name = part.name;
    std::size_t& number = next.try_emplace(name, 2).first->second;
    while (used.contains(part.name) || (part.name != name && all.contains(part.name)))
      part.name = fmt::format("{}-{}", name, number++);
    used.insert(part.name);
  }
}

void append(Surface& surface, Surface other) {
  const auto shifted = [](std::vector<std::uint32_t>& to, const std::vector<std::uint32_t>& from,
                          std::size_t by) {
    to.reserve(to.size() + from.size());
    for (const std::uint32_t value : from) to.push_back(static_cast<std::uint32_t>(value + by));
  };
  append_columns(surface.vertex_columns, surface.vertices.size(), other.vertex_columns,
                 other.vertices.size());
  append_columns(surface.polygon_columns, surface.polygon_count(), other.polygon_columns,
                 other.polygon_count());
  if (surface.polygon_offsets.empty()) surface.polygon_offsets.push_back(0);
  if (!other.polygon_offsets.empty()) {
    const std::uint32_t corners = surface.polygon_offsets.back();
    surface.polygon_offsets.pop_back();
    shifted(surface.polygon_offsets, other.polygon_offsets, corners);
  }
  shifted(surface.polygon_vertices, other.polygon_vertices, surface.vertices.size());
  shifted(surface.polygon_face, other.polygon_face, surface.faces.size());
  shifted(surface.part_source, other.part_source, surface.sources.size());
  for (SurfaceFace& face : other.faces) {
    face.part += static_cast<std::uint32_t>(surface.parts.size());
    surface.faces.push_back(std::move(face));
  }
  surface.vertices.insert(surface.vertices.end(), other.vertices.begin(), other.vertices.end());
  std::move(other.parts.begin(), other.parts.end(), std::back_inserter(surface.parts));
  std::move(other.sources.begin(), other.sources.end(), std::back_inserter(surface.sources));
  make_part_names_unique(surface, "part");
}

}  // namespace flexel
