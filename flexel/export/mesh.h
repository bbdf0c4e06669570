// A mesh for analysis by another program: the lattice's cells as hexahedra, or second-order tetrahedra made
// by gmsh. Selections are resolved on its `body` as in a run (simulate/input/selection.h).
#pragma once
#include <array>
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "formats/lattice/body.h"
#include "simulate/state/state.h"

namespace flexel::mesh_export {

// One side of an element, numbered from 0 in the order of CalculiX and Abaqus (S1 ...).
struct ElementSide {
  std::uint32_t element = 0;
  std::uint8_t side = 0;
};

// Elements of one material: those of a part with about the same fill.
struct MeshSection {
  std::uint32_t part = 0;
  double fill = 1;  // the mean over them, by volume; 1 where whole
  std::size_t elements = 0;
};

struct AnalysisMesh {
  enum class Kind { hexahedra, tetrahedra };
  Kind kind = Kind::hexahedra;
  // Nodes are its elements: `rest` (nodes x 3) [m], a contiguous range a part. Hexahedra: the lattice itself,
  // with the part's own surface. Tetrahedra: the surface is the mesh's own, its polygons named by the CAD
  // faces.
  Body body;
  std::uint32_t nodes_per_element = 8;
  std::vector<std::uint32_t> nodes;    // (elements x nodes_per_element) in the order of C3D8 or C3D10
  std::vector<std::uint32_t> section;  // (elements) index into sections
  std::vector<MeshSection> sections;   // by part, whole ones first
  std::vector<std::vector<ElementSide>> sides;  // (faces of body.surface) on each, ascending
  std::vector<ElementSide> polygon_side;        // tetrahedra: (polygons of body.surface)
  std::vector<std::string> notes;               // what a reader must know of it

  [[nodiscard]] std::size_t element_count() const { return section.size(); }
  [[nodiscard]] const std::uint32_t* element(std::size_t e) const {
    return nodes.data() + e * nodes_per_element;
  }
};

// Places of a side's nodes among those of its element: the corners, outward, then for C3D10 the middles of
// the edges after each corner.
constexpr std::array<std::array<std::uint8_t, 4>, 6> kHexahedronSides = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
constexpr std::array<std::array<std::uint8_t, 6>, 4> kTetrahedronSides = {
    {{0, 2, 1, 6, 5, 4}, {0, 1, 3, 4, 8, 7}, {1, 2, 3, 5, 9, 8}, {2, 0, 3, 6, 7, 9}}};

// Nodes that elements use (nodes): 1.
[[nodiscard]] std::vector<std::uint8_t> used_nodes(const AnalysisMesh& mesh);
// m^3 of matter (fill included) in each section, and of each CAD face of it the area [m^2] of its sides.
[[nodiscard]] std::vector<double> section_volumes(const AnalysisMesh& mesh);
[[nodiscard]] std::vector<double> side_areas(const AnalysisMesh& mesh);
// Tetrahedra whose quadratic map folds at a point where it is integrated: no program can use them.
[[nodiscard]] std::size_t folded_tetrahedra(const AnalysisMesh& mesh);

}  // namespace flexel::mesh_export
