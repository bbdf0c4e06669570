// Fixes and moves on a mesh. Tetrahedra have nodes on the CAD face, which are held. So does a lattice where
// the face lies in a lattice plane. Where the face cuts through cells, it crosses lattice edges: on each edge
// along the axis nearest to the face's normal, an equation between the edge's two nodes prescribes the
// interpolated displacement at the crossing.
#include "flexel/export/support_constraints.h"
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/error.h"
#include "flexel/export/analysis.h"
#include "simulate/matter/surface_points.h"

namespace flexel::mesh_export {
namespace {

constexpr double kOnNode = 0.03;  // of the spacing: a node this near to the face is on it
constexpr double kWeight = 1e-6;  // of a surface point on an edge

// A lattice edge, and the surface near it.
struct Crossing {
  double weight = 0;
  Vec3 position = Vec3::Zero(), normal = Vec3::Zero();  // sums
  double spacing = 0;
};
using Crossings = std::map<std::pair<std::uint32_t, std::uint32_t>, Crossing>;

Crossings crossings(const std::vector<simulate::SurfacePoint>& points, const AnalysisMesh& mesh) {
  Crossings found;
  for (const simulate::SurfacePoint& point : points) {
    const Lattice& lattice = mesh.body.parts[mesh.body.surface.polygon_part(point.polygon)].lattice;
    const double area = point.area_vector.norm();
    Eigen::Index axis = 0;
    (lattice.axes.transpose() * point.area_vector).cwiseAbs().maxCoeff(&axis);
    const std::size_t bit = std::size_t{1} << axis;
    for (std::size_t a = 0; a < point.at.count; ++a) {
      if (a & bit) continue;
      const double weight = area * (point.at.weights[a] + point.at.weights[a | bit]);
      if (!(weight > kWeight * area)) continue;
      Crossing& edge = found[{point.at.elements[a], point.at.elements[a | bit]}];
      edge.weight += weight;
      edge.position += weight * point.position;
      edge.normal += weight / area * point.area_vector;
      edge.spacing = lattice.spacing[axis];
    }
  }
  return found;
}

class Holder {
 public:
  Holder(const simulate::Tie& tie, const AnalysisMesh& mesh, HeldValues& taken, std::size_t& shared)
      : tie_(tie), mesh_(mesh), taken_(taken), shared_(shared) {
    support_.name = tie.name;
    support_.is_move = tie.is_move;
  }

  void node(std::uint32_t node) {
    support_.nodes.push_back(node);
    const Vec3 moved = tie_.motion.displacement(mesh_.body.rest[node], 1);
    for (std::uint8_t axis = 0; axis < 3; ++axis) {
      if (!tie_.axes[axis]) continue;
      const auto [entry, fresh] = taken_.try_emplace({node, axis}, moved[axis]);
      if (fresh)
        support_.held.push_back({node, axis, moved[axis]});
      else if (!(entry->second == moved[axis]))
        ++shared_;
    }
  }

  // The nearer node is eliminated, unless it is held or eliminated already.
  void crossing(std::uint32_t near, double near_factor, std::uint32_t far, double far_factor) {
    const Vec3 moved = near_factor * tie_.motion.displacement(mesh_.body.rest[near], 1) +
                       far_factor * tie_.motion.displacement(mesh_.body.rest[far], 1);
    for (std::uint8_t axis = 0; axis < 3; ++axis) {
      if (!tie_.axes[axis]) continue;
      NodeEquation equation{near, far, near_factor, far_factor, axis, moved[axis]};
      if (taken_.count({near, axis})) {
        if (taken_.count({far, axis})) continue;
        std::swap(equation.first, equation.second);
        std::swap(equation.first_factor, equation.second_factor);
      }
      taken_[{equation.first, axis}] = std::numeric_limits<double>::quiet_NaN();
      support_.equations.push_back(equation);
    }
  }

  AnalysisSupport finish() {
    std::sort(support_.nodes.begin(), support_.nodes.end());
    support_.nodes.erase(std::unique(support_.nodes.begin(), support_.nodes.end()), support_.nodes.end());
    return std::move(support_);
  }

 private:
  const simulate::Tie& tie_;
  const AnalysisMesh& mesh_;
  HeldValues& taken_;
  std::size_t& shared_;
  AnalysisSupport support_;
};

void hold_cut_cells(const Crossings& edges, const AnalysisMesh& mesh, const std::vector<std::uint8_t>& used,
                    Holder& holder) {
  struct Cut {
    std::uint32_t near, far;
    double near_factor, far_factor;
  };
  std::vector<Cut> cuts;
  std::vector<std::uint32_t> on_face;
  for (const auto& [nodes, edge] : edges) {
    if (!used[nodes.first] || !used[nodes.second] || !(edge.normal.norm() > 0)) continue;
    const Vec3 normal = edge.normal.normalized(), middle = edge.position / edge.weight;
    const double a = normal.dot(mesh.body.rest[nodes.first] - middle);
    const double b = normal.dot(mesh.body.rest[nodes.second] - middle);
    const double on = kOnNode * edge.spacing;
    if (std::abs(a) < on) on_face.push_back(nodes.first);
    if (std::abs(b) < on) on_face.push_back(nodes.second);
    if (std::abs(a) < on || std::abs(b) < on || a * b > 0) continue;
    const double length = std::abs(a) + std::abs(b);
    if (std::abs(a) <= std::abs(b))
      cuts.push_back({nodes.first, nodes.second, std::abs(b) / length, std::abs(a) / length});
    else
      cuts.push_back({nodes.second, nodes.first, std::abs(a) / length, std::abs(b) / length});
  }
  std::sort(on_face.begin(), on_face.end());
  on_face.erase(std::unique(on_face.begin(), on_face.end()), on_face.end());
  for (const std::uint32_t node : on_face) holder.node(node);
  for (const Cut& cut : cuts) holder.crossing(cut.near, cut.near_factor, cut.far, cut.far_factor);
}

std::vector<std::uint32_t> nodes_of_polygons(const AnalysisMesh& mesh,
                                             const std::vector<std::uint32_t>& polygons) {
  std::vector<std::uint32_t> nodes;
  for (const std::uint32_t p : polygons) {
    const ElementSide& at = mesh.polygon_side[p];
    for (const std::uint8_t place : kTetrahedronSides[at.side])
      nodes.push_back(mesh.element(at.element)[place]);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

}  // namespace

AnalysisSupport hold(const simulate::Tie& tie, const AnalysisMesh& mesh, const simulate::Problem& problem,
                     HeldValues& taken, std::size_t& shared) {
  const simulate::Selected selected = resolve(tie.where, mesh.body);
  const std::vector<std::uint8_t> used = used_nodes(mesh);
  Holder holder(tie, mesh, taken, shared);
  for (const std::uint32_t node : selected.elements)
    if (used[node]) holder.node(node);
  if (mesh.kind == AnalysisMesh::Kind::tetrahedra)
    for (const std::uint32_t node : nodes_of_polygons(mesh, selected.polygons)) holder.node(node);
  else if (!selected.polygons.empty())
    hold_cut_cells(crossings(surface_points(problem, selected.polygons), mesh), mesh, used, holder);
  AnalysisSupport support = holder.finish();
  if (support.nodes.empty() && support.equations.empty())
    throw InputError(tie.origin, fmt::format("\"{}\": no node of the mesh lies under the selected surface; "
                                             "use a smaller --size",
                                             tie.name));
  return support;
}

}  // namespace flexel::mesh_export
