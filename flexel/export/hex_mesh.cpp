// Every sound cell is a hexahedron. Its sides that no other cell shares are the mesh's skin; each belongs to
// the CAD face whose polygons bound the cell with the most area facing its way.
#include "flexel/export/hex_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "base/math/area_vector.h"
#include "base/units.h"
#include "flexel/export/mesh.h"
#include "simulate/models/cells.h"

namespace flexel::mesh_export {
namespace {

constexpr double kWhole = 1 - 1e-9;
constexpr int kClasses = 20;
constexpr double kSideFacing = 0.1;  // least cosine between a side and the surface it represents
// Corner a = i + 2 j + 4 k of a cell by its place in C3D8.
constexpr std::array<std::uint8_t, 8> kOrder = {0, 1, 3, 2, 4, 5, 7, 6};

// Sections by (part, class); class kClasses is that of whole cells and goes first.
void assign_sections(const simulate::Problem& problem, const std::vector<std::uint32_t>& cells,
                     AnalysisMesh& mesh) {
  const std::vector<std::uint32_t> part = cell_parts(problem.body);
  struct Found {
    double fill = 0;
    std::size_t count = 0;
  };
  const auto key = [&](std::uint32_t cell) {
    const double fill = problem.body.fill[cell];
    const int of = fill >= kWhole ? kClasses : std::min(kClasses - 1, static_cast<int>(fill * kClasses));
    return std::pair(part[cell], kClasses - of);
  };
  std::map<std::pair<std::uint32_t, int>, Found> found;
  for (const std::uint32_t cell : cells) {
    Found& each = found[key(cell)];
    each.fill += problem.body.fill[cell];
    ++each.count;
  }
  std::map<std::pair<std::uint32_t, int>, std::uint32_t> index;
  for (const auto& [at, each] : found) {
    index[at] = static_cast<std::uint32_t>(mesh.sections.size());
    mesh.sections.push_back(
        {at.first, at.second == 0 ? 1 : each.fill / static_cast<double>(each.count), each.count});
  }
  for (const std::uint32_t cell : cells) mesh.section.push_back(index[key(cell)]);
}

// Polygons that bound each cell.
std::vector<std::vector<std::uint32_t>> polygons_of_cells(const Body& body) {
  std::vector<std::vector<std::uint32_t>> result(body.cell_count());
  for (std::uint32_t p = 0; p + 1 < body.surface_cell_offsets.size(); ++p)
    for (std::uint32_t i = body.surface_cell_offsets[p]; i < body.surface_cell_offsets[p + 1]; ++i)
      result[body.surface_cells[i]].push_back(p);
  return result;
}

void find_sides(const std::vector<std::uint32_t>& cells, AnalysisMesh& mesh) {
  const Body& body = mesh.body;
  std::map<std::array<std::uint32_t, 4>, std::pair<int, ElementSide>> skin;
  const auto corners = [&](const ElementSide& at) {
    std::array<std::uint32_t, 4> result;
    for (std::size_t c = 0; c < 4; ++c) result[c] = mesh.element(at.element)[kHexahedronSides[at.side][c]];
    return result;
  };
  for (std::uint32_t e = 0; e < cells.size(); ++e)
    for (std::uint8_t s = 0; s < 6; ++s) {
      auto sorted = corners({e, s});
      std::sort(sorted.begin(), sorted.end());
      auto& [count, side] = skin[sorted];
      ++count;
      side = {e, s};
    }
  const auto polygons = polygons_of_cells(body);
  mesh.sides.resize(body.surface.faces.size());
  for (const auto& [sorted, entry] : skin) {
    if (entry.first != 1) continue;
    const Vec3 outward = area_vector(body.rest, corners(entry.second)).normalized();
    std::map<std::uint32_t, double> facing;  // by CAD face
    for (const std::uint32_t p : polygons[cells[entry.second.element]]) {
      const Vec3 area = area_vector(body.surface.vertices, body.surface.polygon(p));
      if (const double along = area.dot(outward); along > kSideFacing * area.norm())
        facing[body.surface.polygon_face[p]] += along;
    }
    const auto most = std::max_element(facing.begin(), facing.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most != facing.end()) mesh.sides[most->first].push_back(entry.second);
  }
  for (auto& list : mesh.sides)
    std::sort(list.begin(), list.end(), [](const ElementSide& a, const ElementSide& b) {
      return std::pair(a.element, a.side) < std::pair(b.element, b.side);
    });
}

}  // namespace

AnalysisMesh hexahedra(const simulate::Problem& problem) {
  AnalysisMesh mesh;
  mesh.body = problem.body;
  const std::vector<std::uint8_t> sound = sound_cells(problem);
  std::vector<std::uint32_t> cells;
  for (std::uint32_t c = 0; c < sound.size(); ++c)
    if (sound[c]) cells.push_back(c);
  for (const std::uint32_t cell : cells)
    for (const std::uint8_t corner : kOrder) mesh.nodes.push_back(mesh.body.cell_elements[cell][corner]);
  assign_sections(problem, cells, mesh);
  find_sides(cells, mesh);
  std::size_t partial = 0;
  double least = 1;
  for (const std::uint32_t cell : cells)
    if (problem.body.fill[cell] < kWhole) {
      ++partial;
      least = std::min(least, problem.body.fill[cell]);
    }
  if (partial > 0)
    mesh.notes.push_back(
        fmt::format("{} of {} hexahedra are only partly filled by the part (down to {:.3g}). They keep their "
                    "whole shape; in classes of 0.05 their Young's modulus and density are the material's "
                    "times the mean fill, so stresses in them are those of that softer matter",
                    human_count(partial), human_count(cells.size()), least));
  if (const std::size_t left_out = problem.body.cell_count() - cells.size(); left_out > 0)
    mesh.notes.push_back(fmt::format("{} cells of loose crumbs that hang on nothing are left out of the mesh",
                                     human_count(left_out)));
  return mesh;
}

}  // namespace flexel::mesh_export
