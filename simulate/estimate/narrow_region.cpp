// Edges are told by the coordinates of their ends: a file may give each polygon vertices of its own.
#include "simulate/estimate/narrow_region.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "base/human.h"
#include "base/math/area_vector.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/scene/strength.h"

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

namespace {

constexpr double kCells = 2;  // across a region, from which on its lattice resolves it

std::vector<std::uint32_t> joined(const std::vector<std::vector<std::uint32_t>>& regions) {
  std::vector<std::uint32_t> all;
  for (const std::vector<std::uint32_t>& region : regions)
    all.insert(all.end(), region.begin(), region.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

template <class Conditions>
std::vector<std::vector<std::uint32_t>> regions_of(const Conditions& conditions, const Body& body) {
  std::vector<std::vector<std::uint32_t>> regions;
  for (const auto& each : conditions) regions.push_back(resolve(each.where, body).polygons);
  return regions;
}

// m, where the region lies amid matter and is under two cells wide.
std::optional<double> width_under_two_cells(const Body& body, const std::vector<std::uint32_t>& region,
                                            const std::vector<std::uint32_t>& taken) {
  if (region.empty()) return std::nullopt;
  const std::optional<double> width = width_amid_matter(body.surface, region, taken);
  const Part& part = body.parts[body.surface.polygon_part(region.front())];
  return width && *width < kCells * part.lattice.spacing.mean() ? width : std::nullopt;
}

double area_of(const Surface& surface, const std::vector<std::uint32_t>& region) {
  double area = 0;
  for (const std::uint32_t polygon : region)
    area += area_vector(surface.vertices, surface.polygon(polygon)).norm();
  return area;
}

constexpr double kAsHard = 0.5;  // of the traction: what is pushed so beside a region gives way with it

// What the loads of one region push on it.
struct PressedRegion {
  std::string load;  // the first
  std::vector<std::uint32_t> polygons;
  double area = 0;             // m^2
  Vec3 forces = Vec3::Zero();  // N
  double pressure = 0;         // Pa
  [[nodiscard]] double force() const { return forces.norm() + std::abs(pressure) * area; }
};

std::vector<PressedRegion> pressed_regions(const Body& body, const Scene& scene) {
  std::vector<PressedRegion> pressed;
  for (const Load& load : scene.get<Loads>().loads) {
    const std::vector<std::uint32_t> polygons = resolve(load.where, body).polygons;
    if (polygons.empty()) continue;
    auto found = std::find_if(pressed.begin(), pressed.end(),
                              [&](const PressedRegion& each) { return each.polygons == polygons; });
    if (found == pressed.end())
      found = pressed.insert(found, {load.name, polygons, area_of(body.surface, polygons)});
    found->forces += load.force.value_or(Vec3::Zero());
    found->pressure += load.pressure.value_or(0);
  }
  return pressed;
}

}  // namespace

std::string support_under_two_cells(const Body& body, const Scene& scene) {
  const std::vector<Tie>& ties = scene.get<Supports>().ties;
  const std::vector<std::vector<std::uint32_t>> regions = regions_of(ties, body);
  const std::vector<std::uint32_t> held = joined(regions);
  for (std::size_t t = 0; t < ties.size(); ++t)
    if (const auto width = width_under_two_cells(body, regions[t], held))
      return fmt::format("the {} \"{}\" is narrow (a strip of its area and rim is {} wide, under two cells)",
                         ties[t].link ? "rigid link" : "support", ties[t].name, human_length(*width));
  return "";
}

std::vector<UnresolvedIndentation> indentations_under_two_cells(const Body& body, const Scene& scene) {
  const std::vector<PressedRegion> pressed = pressed_regions(body, scene);
  const std::vector<std::vector<std::uint32_t>> held = regions_of(scene.get<Supports>().ties, body);
  const std::vector<Material> materials = known_materials(scene, body);
  std::vector<UnresolvedIndentation> found;
  for (const PressedRegion& each : pressed) {
    std::vector<std::vector<std::uint32_t>> taken = held;
    for (const PressedRegion& other : pressed)
      if (other.force() * each.area >= kAsHard * each.force() * other.area) taken.push_back(other.polygons);
    const auto width = width_under_two_cells(body, each.polygons, joined(taken));
    if (!width) continue;
    const std::size_t part = body.surface.polygon_part(each.polygons.front());
    const Material& material = materials[part];
    if (!(each.force() > 0) || !(material.young > 0)) continue;
    const double spacing = body.parts[part].lattice.spacing.mean();
    const double under_load = 1.122 * (1 - material.poisson * material.poisson) * each.force() /
                              (material.young * std::sqrt(each.area));
    found.push_back({each.load, each.polygons, *width, under_load * spacing / (*width + spacing)});
  }
  return found;
}

}  // namespace flexel::simulate
