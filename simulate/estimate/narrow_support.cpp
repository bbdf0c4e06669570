// Edges are told by the coordinates of their ends: a file may give each polygon vertices of its own.
#include "simulate/estimate/narrow_support.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <iterator>
#include <map>

#include "base/human.h"
#include "base/math/area_vector.h"
#include "simulate/effects/supports.h"

namespace flexel::simulate {
namespace {

constexpr double kRimShare =
    1.0 / 3;  // of the rim: the flank of a tooth has its root beside it, the end of a bar nothing
constexpr double kFlushTurn = 0.01;  // sine of the turn: less than the first facet of a fillet has

using EndsOfRim = std::array<std::array<double, 3>, 2>;

std::array<double, 3> rim_point(const Vec3& at) {
  return {at.x(), at.y(), at.z()};
}

// The directed edges of a polygon, by their ends.
template <class Use>
void for_each_rim_edge(const Surface& surface, std::uint32_t polygon, const Use& use) {
  const auto corners = surface.polygon(polygon);
  for (std::size_t i = 0; i < corners.size(); ++i)
    use(surface.vertices[corners[i]], surface.vertices[corners[(i + 1) % corners.size()]]);
}

}  // namespace

std::optional<double> width_amid_matter(const Surface& surface, const std::vector<std::uint32_t>& polygons,
                                        const std::vector<std::uint32_t>& held) {
  std::map<EndsOfRim, std::uint32_t> rim;  // directed edges of the region whose opposite is not of it
  double area = 0;
  for (const std::uint32_t polygon : polygons) {
    area += area_vector(surface.vertices, surface.polygon(polygon)).norm();
    for_each_rim_edge(surface, polygon, [&](const Vec3& a, const Vec3& b) {
      if (rim.erase({rim_point(b), rim_point(a)}) == 0) rim[{rim_point(a), rim_point(b)}] = polygon;
    });
  }
  double length = 0, beside = 0;
  for (const auto& [ends, polygon] : rim)
    length += (Eigen::Map<const Vec3>(ends[1].data()) - Eigen::Map<const Vec3>(ends[0].data())).norm();
  for (std::uint32_t other = 0; other < surface.polygon_count(); ++other) {
    if (std::binary_search(held.begin(), held.end(), other)) continue;
    for_each_rim_edge(surface, other, [&](const Vec3& a, const Vec3& b) {
      const auto found = rim.find({rim_point(b), rim_point(a)});
      if (found == rim.end()) return;
      const Vec3 own = area_vector(surface.vertices, surface.polygon(found->second)).normalized();
      const Vec3 its = area_vector(surface.vertices, surface.polygon(other)).normalized();
      // Away from the edge within the other polygon; above the region's plane it rises.
      const Vec3 inward = its.cross(b - a).normalized();
      if (own.dot(inward) > -kFlushTurn) beside += (b - a).norm();
    });
  }
  if (!(beside > kRimShare * length) || !(length > 0)) return std::nullopt;
  return 2 * area / length;
}

std::string support_under_two_cells(const Body& body, const Scene& scene) {
  constexpr double kCells = 2;
  const std::vector<Tie>& ties = scene.get<Supports>().ties;
  std::vector<std::vector<std::uint32_t>> regions;
  std::vector<std::uint32_t> held;
  for (const Tie& tie : ties) {
    regions.push_back(resolve(tie.where, body).polygons);
    std::vector<std::uint32_t> all;
    std::set_union(held.begin(), held.end(), regions.back().begin(), regions.back().end(),
                   std::back_inserter(all));
    held = std::move(all);
  }
  for (std::size_t t = 0; t < ties.size(); ++t) {
    if (regions[t].empty()) continue;
    const Part& part = body.parts[body.surface.polygon_part(regions[t].front())];
    const std::optional<double> width = width_amid_matter(body.surface, regions[t], held);
    if (width && *width < kCells * part.lattice.spacing.mean())
      return fmt::format("the {} \"{}\" is narrow (a strip of its area and rim is {} wide, under two cells)",
                         ties[t].link ? "rigid link" : "support", ties[t].name, human_length(*width));
  }
  return "";
}

}  // namespace flexel::simulate
