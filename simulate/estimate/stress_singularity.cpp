// Edges are told by the coordinates of their ends: a file may give each polygon vertices of its own.
#include "simulate/estimate/stress_singularity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "base/math/area_vector.h"
#include "formats/pieces/other_pieces.h"

namespace flexel::simulate {
namespace {

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
  std::size_t polygon, corner;
  bool forward;
};

// rad; 0: it is flat or convex.
double re_entrant_turn(const Surface& surface, const Ends& ends, const std::vector<EdgeUse>& uses) {
  if (uses.size() != 2) return 0;
  const Vec3 one = facet_normal(surface, uses[0].polygon), other = facet_normal(surface, uses[1].polygon);
  const Vec3 along = Eigen::Map<const Vec3>(ends[1].data()) - Eigen::Map<const Vec3>(ends[0].data());
  // Where the other polygon rises above this one's plane the matter fills more than half of the space around.
  const Vec3 inward = other.cross(uses[1].forward ? along : Vec3(-along));
  return one.dot(inward) > 0 ? std::acos(std::clamp(one.dot(other), -1.0, 1.0)) : 0;
}

// m, of a polygon across one of its edges.
double width_across(const Surface& surface, std::size_t polygon, const Vec3& a, const Vec3& b) {
  const Vec3 along = (b - a).normalized();
  double most = 0;
  for (const std::uint32_t v : surface.polygon(polygon)) {
    const Vec3 from = surface.vertices[v] - a;
    most = std::max(most, (from - along.dot(from) * along).norm());
  }
  return most;
}

using EdgesByEnds = std::map<Ends, std::vector<EdgeUse>>;

// Of the edges that `wanted`(a, b) says.
template <class Wanted>
EdgesByEnds edges_by_ends(const Surface& surface, const Wanted& wanted) {
  EdgesByEnds edges;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const auto corners = surface.polygon(p);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3& a = surface.vertices[corners[i]];
      const Vec3& b = surface.vertices[corners[(i + 1) % corners.size()]];
      if (!wanted(a, b)) continue;
      Ends ends{{{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}}};
      const bool forward = ends[0] < ends[1];
      if (!forward) std::swap(ends[0], ends[1]);
      edges[ends].push_back({p, i, forward});
    }
  }
  return edges;
}

bool re_entrant_edge_within(const Surface& surface, const Vec3& at, double reach) {
  const EdgesByEnds near = edges_by_ends(
      surface, [&](const Vec3& a, const Vec3& b) { return distance_to_segment(at, a, b) <= reach; });
  return std::any_of(near.begin(), near.end(), [&](const auto& edge) {
    return re_entrant_turn(surface, edge.first, edge.second) > kSharpTurn;
  });
}

}  // namespace

std::vector<ReEntrantEdge> re_entrant_edges(const Surface& surface, double least) {
  std::vector<ReEntrantEdge> found;
  for (const auto& [ends, uses] : edges_by_ends(surface, [](const Vec3&, const Vec3&) { return true; })) {
    const double turn = re_entrant_turn(surface, ends, uses);
    if (!(turn > least)) continue;
    const auto corners = surface.polygon(uses[0].polygon);
    ReEntrantEdge edge;
    edge.vertices = {corners[uses[0].corner], corners[(uses[0].corner + 1) % corners.size()]};
    edge.ends = {surface.vertices[edge.vertices[0]], surface.vertices[edge.vertices[1]]};
    edge.turn = turn;
    edge.width = std::min(width_across(surface, uses[0].polygon, edge.ends[0], edge.ends[1]),
                          width_across(surface, uses[1].polygon, edge.ends[0], edge.ends[1]));
    found.push_back(edge);
  }
  return found;
}

double distance_to(const ReEntrantEdge& edge, const Vec3& at) {
  return distance_to_segment(at, edge.ends[0], edge.ends[1]);
}

std::string singular_beside(const Body& body, const std::vector<std::uint8_t>& tied, const Vec3& at,
                            double reach) {
  std::uint8_t found = 0;
  for (std::uint32_t e = 0; e < tied.size() && found == 0; ++e)
    if (tied[e] >= 2 && counts_element(e) && (body.rest[e] - at).norm() <= reach) found = tied[e];
  if (over_pieces(found == 2 ? 1 : 0) > 0) return "a support";
  if (found > 2) return "a bond";  // bodies in pieces have none
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
