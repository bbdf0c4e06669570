// Consistent nodal forces, and probes as weighted means of nodes. On a lattice they are those of a Flexel
// run. On tetrahedra the load is integrated over the six-node triangles (seven points, exact to the fifth
// degree: Radon 1948) and distributed to the six nodes by their shape functions.
#include "flexel/export/nodal_forces.h"
#include <Eigen/Geometry>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "flexel/export/analysis.h"
#include "simulate/matter/load_distribution.h"
#include "simulate/probes/probes.h"

namespace flexel::mesh_export {
namespace {

struct TrianglePoint {
  std::array<double, 6> shape{};  // corners, then the middles of the edges after them
  std::array<double, 6> by_r{}, by_s{};
  double weight = 0;  // of the unit triangle, whose area is 1/2
};

TrianglePoint triangle_point(double r, double s, double weight) {
  const double t = 1 - r - s;
  return {{t * (2 * t - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * t * r, 4 * r * s, 4 * s * t},
          {1 - 4 * t, 4 * r - 1, 0, 4 * (t - r), 4 * s, -4 * s},
          {1 - 4 * t, 0, 4 * s - 1, -4 * r, 4 * r, 4 * (t - s)},
          weight};
}

std::array<TrianglePoint, 7> triangle_rule() {
  const double root = std::sqrt(15.0);
  const double a = (6 - root) / 21, b = (6 + root) / 21;
  const double of_a = (155 - root) / 2400, of_b = (155 + root) / 2400;
  return {triangle_point(1.0 / 3, 1.0 / 3, 9.0 / 80),
          triangle_point(a, a, of_a),
          triangle_point(1 - 2 * a, a, of_a),
          triangle_point(a, 1 - 2 * a, of_a),
          triangle_point(b, b, of_b),
          triangle_point(1 - 2 * b, b, of_b),
          triangle_point(b, 1 - 2 * b, of_b)};
}

// A point that carries load, and the nodes that it hands it on to.
struct Carried {
  simulate::LoadedPoint point;
  std::array<std::uint32_t, 6> nodes{};
  std::array<double, 6> shape{};
  std::size_t count = 6;
};

std::vector<Carried> surface_points_of(const AnalysisMesh& mesh, const std::vector<std::uint32_t>& polygons) {
  static const std::array<TrianglePoint, 7> rule = triangle_rule();
  std::vector<Carried> result;
  for (const std::uint32_t p : polygons) {
    Carried each;
    const ElementSide& at = mesh.polygon_side[p];
    for (std::size_t i = 0; i < 6; ++i)
      each.nodes[i] = mesh.element(at.element)[kTetrahedronSides[at.side][i]];
    for (const TrianglePoint& q : rule) {
      Vec3 position = Vec3::Zero(), along_r = Vec3::Zero(), along_s = Vec3::Zero();
      for (std::size_t i = 0; i < 6; ++i) {
        const Vec3& x = mesh.body.rest[each.nodes[i]];
        position += q.shape[i] * x;
        along_r += q.by_r[i] * x;
        along_s += q.by_s[i] * x;
      }
      const Vec3 area = q.weight * along_r.cross(along_s);
      each.point = {position, area.norm(), area.normalized()};
      each.shape = q.shape;
      result.push_back(each);
    }
  }
  return result;
}

// Nodes of a selected region, by the matter around each: a tenth of every tetrahedron.
std::vector<Carried> region_points_of(const AnalysisMesh& mesh, const std::vector<std::uint32_t>& nodes) {
  std::vector<double> volume(mesh.body.rest.size(), 0);
  for (std::size_t e = 0; e < mesh.element_count(); ++e) {
    const std::uint32_t* n = mesh.element(e);
    const auto& x = mesh.body.rest;
    const double whole = (x[n[1]] - x[n[0]]).cross(x[n[2]] - x[n[0]]).dot(x[n[3]] - x[n[0]]) / 6;
    for (std::size_t i = 0; i < mesh.nodes_per_element; ++i) volume[n[i]] += 0.1 * whole;
  }
  std::vector<Carried> result;
  for (const std::uint32_t node : nodes)
    result.push_back({{mesh.body.rest[node], volume[node]}, {node}, {1}, 1});
  return result;
}

std::vector<Vec3> forces_on_tetrahedra(const simulate::Load& load, const AnalysisMesh& mesh) {
  const simulate::Selected selected = resolve(load.where, mesh.body);
  if (!selected.polygons.empty() && !selected.elements.empty())
    throw InputError(load.origin,
                     fmt::format("load \"{}\" mixes surface and elements; write two loads", load.name));
  if (selected.polygons.empty() && (load.pressure || load.bearing))
    throw InputError(load.origin, fmt::format("load \"{}\": a {} needs a face, group or side", load.name,
                                              load.pressure ? "pressure" : "bearing load"));
  const std::vector<Carried> carried = selected.polygons.empty() ? region_points_of(mesh, selected.elements)
                                                                 : surface_points_of(mesh, selected.polygons);
  std::vector<simulate::LoadedPoint> points;
  for (const Carried& each : carried) points.push_back(each.point);
  std::optional<std::vector<Vec3>> forces;
  if (load.pressure) {
    forces.emplace();
    for (const simulate::LoadedPoint& each : points)
      forces->push_back(-*load.pressure * each.weight * each.normal);
  } else if (load.bearing) {
    forces = bearing(points, *load.force);
  } else {
    forces = averaging_link(points, load.force.value_or(Vec3::Zero()), load.torque.value_or(Vec3::Zero()),
                            load.at);
  }
  if (!forces)
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": the selection cannot take it; a bearing load needs a cylindrical face that "
                    "looks against it, a moment more than a line of points",
                    load.name));
  std::vector<Vec3> sum(mesh.body.rest.size(), Vec3::Zero());
  for (std::size_t q = 0; q < carried.size(); ++q)
    for (std::size_t i = 0; i < carried[q].count; ++i)
      sum[carried[q].nodes[i]] += carried[q].shape[i] * (*forces)[q];
  return sum;
}

}  // namespace

AnalysisProbe place_probe(const simulate::Probe& probe, const AnalysisMesh& mesh,
                          const simulate::Problem& problem) {
  AnalysisProbe result;
  result.name = probe.name;
  if (mesh.kind == AnalysisMesh::Kind::hexahedra) {
    simulate::Scene only;
    only.probes.push_back(probe);
    result.weights = place_probes(only, problem).front().weights;
    return result;
  }
  std::map<std::uint32_t, double> weights;
  if (probe.where) {
    const simulate::Selected selected = resolve(*probe.where, mesh.body);
    for (const Carried& each : surface_points_of(mesh, selected.polygons))
      for (std::size_t i = 0; i < each.count; ++i)
        weights[each.nodes[i]] += each.shape[i] * each.point.weight;
    if (selected.polygons.empty())
      for (const Carried& each : region_points_of(mesh, selected.elements))
        weights[each.nodes[0]] += each.point.weight;
  } else {
    result.distance = 1e300;
    for (std::uint32_t node = 0; node < mesh.body.rest.size(); ++node)
      if (const double away = (mesh.body.rest[node] - *probe.at).norm(); away < result.distance) {
        result.distance = away;
        weights = {{node, 1}};
      }
  }
  double total = 0;
  for (const auto& [node, weight] : weights) total += weight;
  if (!(total > 0)) throw InputError(probe.origin, fmt::format("probe \"{}\" selects nothing", probe.name));
  for (const auto& [node, weight] : weights) result.weights.emplace_back(node, weight / total);
  return result;
}

std::vector<Vec3> nodal_forces(const simulate::Load& load, const AnalysisMesh& mesh,
                               const simulate::Problem& problem) {
  if (mesh.kind == AnalysisMesh::Kind::tetrahedra) return forces_on_tetrahedra(load, mesh);
  simulate::Loads::Parameters only;
  only.loads.push_back(load);
  simulate::State state;
  state.displacement.assign(mesh.body.rest.size(), Vec3::Zero());
  std::vector<Vec3> forces(mesh.body.rest.size(), Vec3::Zero());
  simulate::Loads::make(only, problem)->add_forces(state, forces);
  return forces;
}

}  // namespace flexel::mesh_export
