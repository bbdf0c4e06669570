// Edges are told by the coordinates of their ends: a file may give each polygon vertices of its own.
#include "simulate/estimate/stress_singularity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "base/math/area_vector.h"

namespace flexel::simulate {
namespace {

constexpr double kSharp =
    std::numbers::pi / 6;  // a finer tessellated fillet turns by less from facet to facet

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 way = b - a;
  const double length = way.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(way) / length, 0.0, 1.0) : 0.0;
  return (p - a - t * way).norm();
}

Vec3 facet_normal(const Surface& surface, std::size_t polygon) {
  return area_vector(surface.vertices, surface.polygon(polygon)).normalized();
}

using Ends = std::array<std::array<double, 3>, 2>;

// A polygon that has an edge, and whether it goes around from the first of the ends to the second.
struct EdgeUse {
  std::size_t polygon;
  bool forward;
};

bool is_re_entrant(const Surface& surface, const Ends& ends, const std::vector<EdgeUse>& uses) {
  if (uses.size() != 2) return false;
  const Vec3 one = facet_normal(surface, uses[0].polygon), other = facet_normal(surface, uses[1].polygon);
  const Vec3 along = Eigen::Map<const Vec3>(ends[1].data()) - Eigen::Map<const Vec3>(ends[0].data());
  // Where the other polygon rises above this one's plane the matter fills more than half of the space around.
  const Vec3 inward = other.cross(uses[1].forward ? along : Vec3(-along));
  const double turn = std::acos(std::clamp(one.dot(other), -1.0, 1.0));
  return one.dot(inward) > 0 && turn > kSharp;
}

bool re_entrant_edge_within(const Surface& surface, const Vec3& at, double reach) {
  std::map<Ends, std::vector<EdgeUse>> edges;  // those that are near
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const auto corners = surface.polygon(p);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3& a = surface.vertices[corners[i]];
      const Vec3& b = surface.vertices[corners[(i + 1) % corners.size()]];
      if (distance_to_segment(at, a, b) > reach) continue;
      Ends ends{{{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}}};
      const bool forward = ends[0] < ends[1];
      if (!forward) std::swap(ends[0], ends[1]);
      edges[ends].push_back({p, forward});
    }
  }
  return std::any_of(edges.begin(), edges.end(),
                     [&](const auto& edge) { return is_re_entrant(surface, edge.first, edge.second); });
}

}  // namespace

std::string singular_beside(const Body& body, const std::vector<std::uint8_t>& tied, const Vec3& at,
                            double reach) {
  for (std::size_t e = 0; e < tied.size(); ++e)
    if (tied[e] >= 2 && (body.rest[e] - at).norm() <= reach) return tied[e] == 2 ? "a support" : "a bond";
  return re_entrant_edge_within(body.surface, at, reach) ? "a re-entrant edge" : "";
}

void mark_singular(const Body& body, const std::vector<std::uint8_t>& tied, SimulateResult& result,
                   double spacings) {
  if (!result.stress) return;
  const auto part = std::find_if(body.parts.begin(), body.parts.end(),
                                 [&](const Part& each) { return each.name == result.stress->part; });
  const double reach = spacings * part->lattice.spacing.maxCoeff();
  result.stress->beside = singular_beside(body, tied, result.stress->at, reach);
}

}  // namespace flexel::simulate
