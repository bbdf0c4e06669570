// Volumes and areas of a mesh. Quadratic tetrahedra are integrated at the four points of C3D10.
#include "flexel/export/mesh.h"

#include <Eigen/Geometry>
#include <cmath>

namespace flexel::mesh_export {
namespace {

// Determinants of the map of a quadratic tetrahedron at its four integration points.
std::array<double, 4> jacobians(const AnalysisMesh& mesh, std::size_t e) {
  static const double a = (5 - std::sqrt(5.0)) / 20, b = 1 - 3 * a;
  std::array<double, 4> result{};
  for (std::size_t q = 0; q < 4; ++q) {
    std::array<double, 4> at{a, a, a, a};  // barycentric
    at[q] = b;
    // Gradients of the barycentric coordinates by the three of the unit tetrahedron
    static const std::array<Vec3, 4> gradient = {Vec3(-1, -1, -1), Vec3::UnitX(), Vec3::UnitY(),
                                                 Vec3::UnitZ()};
    constexpr std::array<std::array<std::size_t, 2>, 6> kEdges = {
        {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
    Mat3 map = Mat3::Zero();
    for (std::size_t c = 0; c < 4; ++c)
      map += mesh.body.rest[mesh.element(e)[c]] * ((4 * at[c] - 1) * gradient[c]).transpose();
    for (std::size_t m = 0; m < 6; ++m) {
      const auto [i, j] = kEdges[m];
      map += mesh.body.rest[mesh.element(e)[4 + m]] *
             (4 * (at[i] * gradient[j] + at[j] * gradient[i])).transpose();
    }
    result[q] = map.determinant();
  }
  return result;
}

}  // namespace

std::vector<std::uint8_t> used_nodes(const AnalysisMesh& mesh) {
  std::vector<std::uint8_t> used(mesh.body.rest.size(), 0);
  for (const std::uint32_t node : mesh.nodes) used[node] = 1;
  return used;
}

std::vector<double> section_volumes(const AnalysisMesh& mesh) {
  std::vector<double> volumes(mesh.sections.size(), 0);
  if (mesh.kind == AnalysisMesh::Kind::hexahedra) {
    for (std::size_t s = 0; s < volumes.size(); ++s)
      volumes[s] = static_cast<double>(mesh.sections[s].elements) * mesh.sections[s].fill *
                   mesh.body.parts[mesh.sections[s].part].lattice.spacing.prod();
    return volumes;
  }
  for (std::size_t e = 0; e < mesh.element_count(); ++e)
    for (const double each : jacobians(mesh, e)) volumes[mesh.section[e]] += each / 24;
  return volumes;
}

std::vector<double> side_areas(const AnalysisMesh& mesh) {
  std::vector<double> areas(mesh.sides.size(), 0);
  const auto& x = mesh.body.rest;
  for (std::size_t f = 0; f < areas.size(); ++f)
    for (const ElementSide& at : mesh.sides[f]) {
      const std::uint32_t* n = mesh.element(at.element);
      if (mesh.kind == AnalysisMesh::Kind::hexahedra) {
        const auto& c = kHexahedronSides[at.side];
        areas[f] += (x[n[c[1]]] - x[n[c[0]]]).cross(x[n[c[3]]] - x[n[c[0]]]).norm();
      } else {
        // four triangles between corners and middles
        const auto& c = kTetrahedronSides[at.side];
        constexpr std::array<std::array<std::size_t, 3>, 4> kPieces = {
            {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};
        for (const auto& [i, j, k] : kPieces)
          areas[f] += 0.5 * (x[n[c[j]]] - x[n[c[i]]]).cross(x[n[c[k]]] - x[n[c[i]]]).norm();
      }
    }
  return areas;
}

std::size_t folded_tetrahedra(const AnalysisMesh& mesh) {
  std::size_t folded = 0;
  if (mesh.kind == AnalysisMesh::Kind::tetrahedra)
    for (std::size_t e = 0; e < mesh.element_count(); ++e)
      for (const double each : jacobians(mesh, e))
        if (!(each > 0)) {
          ++folded;
          break;
        }
  return folded;
}

}  // namespace flexel::mesh_export
