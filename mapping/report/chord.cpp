// The long triangles one by one (mapping/report/flat_triangle.h); their number above a share of the displacement.
#include "mapping/report/chord.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/part/near_weld.h"
#include "mapping/methods/space_map.h"

namespace flexel::mapping {
namespace {

constexpr double kGoodShare = 2.5e-3;  // what sufficient_edge() leaves

double longest_edge(const std::vector<Vec3>& at, std::span<const std::uint32_t> corners) {
  double longest = 0;
  for (std::size_t i = 0; i < corners.size(); ++i)
    longest = std::max(longest, (at[corners[i]] - at[corners[(i + 1) % corners.size()]]).norm());
  return longest;
}

// Whether the corners are held by elements that a fracture has parted.
bool spans_fracture(const Components& fragments, const MapResult& result,
                    const std::array<std::uint32_t, 3>& corners) {
  const auto fragment = [&](int c) { return fragments.of[result.frame_of(corners[c]).elements[0]]; };
  return fragment(0) != fragment(1) || fragment(0) != fragment(2);
}

// (parts) m
std::vector<double> long_edges(const Body& body, double spacings = kLongEdge) {
  std::vector<double> least;
  for (const Part& part : body.parts) least.push_back(spacings * part.lattice.spacing.minCoeff());
  return least;
}

}  // namespace

// The diagonal of a polygon is at most half its perimeter: most meshes need no triangulation.
bool has_long_triangles(const Body& body, double spacings) {
  const Surface& surface = body.surface;
  const std::vector<double> least = long_edges(body, spacings);
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const auto corners = surface.polygon(p);
    const double longest = longest_edge(surface.vertices, corners) * static_cast<double>(corners.size()) /
                           (corners.size() == 3 ? 3 : 2);
    if (longest > least[surface.polygon_part(p)]) return true;
  }
  return false;
}

std::vector<LongTriangle> long_triangles(const Body& body, const MapResult& result) {
  const Surface& surface = body.surface;
  std::vector<LongTriangle> found;
  if (!has_long_triangles(body)) return found;
  const std::vector<double> least = long_edges(body);
  std::optional<Components> fragments;
  if (may_be_broken(body)) fragments = find_components(body, element_adjacency(body));
  const Triangles triangles = triangulate(surface);
  const std::vector<std::uint8_t> unshared = unshared_edges(surface, triangles);
  for (std::uint32_t t = 0; t < triangles.corners.size(); ++t) {
    const auto& corners = triangles.corners[t];
    const std::uint32_t polygon = triangles.polygon[t], part = surface.polygon_part(polygon);
    const double longest = longest_edge(surface.vertices, corners);
    if (!(longest > least[part])) continue;
    if (fragments && spans_fracture(*fragments, result, corners)) continue;
    const auto& at = surface.vertices;
    found.push_back(
        {t, longest, {{at[corners[0]], at[corners[1]], at[corners[2]]}, part, polygon, unshared[t]}});
  }
  return found;
}

std::vector<MissedPoint> look_at(const std::vector<FlatTriangle>& triangles, const Body& body,
                                 const SpaceMap& map) {
  constexpr std::size_t kTrianglesAtATime = 64;
  std::vector<MissedPoint> found(triangles.size());
  ShareCounter done(triangles.size());
  parallel_chunks(triangles.size(), kTrianglesAtATime, [&](std::size_t begin, std::size_t end) {
    FlatTriangles look(body, map);
    for (std::size_t t = begin; t < end; ++t) found[t] = look(triangles[t]);
    done.add(end - begin);
  });
  return found;
}

ChordError chord_error(const Body& body, const MapResult& result) {
  ChordError error;
  for (const Vec3& each : result.displacement)
    if (each.allFinite()) error.largest_displacement = std::max(error.largest_displacement, each.norm());
  if (body.position == body.rest) return error;
  const std::vector<LongTriangle> triangles = long_triangles(body, result);
  if (triangles.empty()) return error;
  const SpaceMap map(body);
  std::vector<FlatTriangle> flat;
  for (const LongTriangle& each : triangles) flat.push_back(each.flat);
  const std::vector<MissedPoint> found = look_at(flat, body, map);
  Box box;
  for (std::size_t t = 0; t < found.size(); ++t) {
    for (const Vec3& corner : flat[t].corners) box.add(corner);
    error.largest_displacement = std::max(error.largest_displacement, found[t].displacement);
    if (found[t].largest <= error.largest) continue;
    error.largest = found[t].largest;
    error.at = found[t].at;
    error.longest_edge = triangles[t].longest;
  }
  const double noise = kChordNoise * box.size().norm();
  for (std::size_t t = 0; t < found.size(); ++t) {
    const double spacing = body.parts[flat[t].part].lattice.spacing.minCoeff();
    const double most = std::min(kCoarseShare * error.largest_displacement, kCoarseSpacings * spacing);
    error.coarse_triangles += found[t].largest > std::max(most, noise);
  }
  return error;
}

double sufficient_edge(const ChordError& error) {
  return error.longest_edge * std::sqrt(std::min(1.0, kGoodShare / error.share()));
}

}  // namespace flexel::mapping
