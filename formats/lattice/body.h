// Body: the lattices of one or more parts, and the surface they came from. The only thing that flows between
// the stages.
//
// Layout. Structure of arrays. Elements are sorted by (part, k, j, i, piece), i.e. along x fastest, so that a
// row of a lattice is contiguous and kernels can sweep planes; cells are sorted the same way by their lowest
// corner. Each part owns one contiguous range of elements and one of cells; no element belongs to two parts.
// Mass, stiffness and radius are not stored: simulate derives them from fill, spacing and material.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/math/vec.h"
#include "formats/part/column.h"
#include "formats/part/surface.h"

namespace flexel {

enum class Placement { corner, centre };

// The grid the elements of one part came from.
// corner: element (i, j, k) rests at origin + axes * (i hx, j hy, k hz); cell (i, j, k) spans elements
// (i..i+1, j..j+1, k..k+1). centre: element (i, j, k) rests at the centre of voxel (i, j, k): origin + axes *
// ((i + 1/2) hx, ...).
struct Lattice {
  Vec3 origin = Vec3::Zero();    // m, world frame
  Mat3 axes = Mat3::Identity();  // columns: the lattice's x, y, z directions in the world frame (a rotation)
  Vec3 spacing = Vec3::Ones();   // hx, hy, hz [m]
  [[nodiscard]] Vec3 to_world(const Vec3& lattice_coordinates) const {  // in units of the spacing
    return origin + axes * lattice_coordinates.cwiseProduct(spacing);
  }
  [[nodiscard]] Vec3 to_lattice(const Vec3& world) const {
    return (axes.transpose() * (world - origin)).cwiseQuotient(spacing);
  }
};

struct Part {
  std::string name;      // that of the SurfacePart of the same index
  std::string material;  // name; "" until voxelize --material or a scene gives one
  Placement placement = Placement::corner;
  Lattice lattice;
  std::uint32_t element_begin = 0, element_end = 0;  // range of elements
  std::uint32_t cell_begin = 0, cell_end = 0;        // range of cells; empty for centre placement
  double surface_volume = 0;  // m^3 enclosed by the part's surface (0 where it is not closed)
};

struct Body {
  std::vector<Part> parts;

  // Elements (n)
  std::vector<Index3> lattice_index;  // (n x 3) in the part's lattice; may be negative
  // (n) distinguishes elements of one part at one lattice index; 0 nearly everywhere
  std::vector<std::uint16_t> piece;
  std::vector<Vec3> rest;      // (n x 3) m, world frame
  std::vector<Vec3> position;  // (n x 3) m, world frame
  Columns element_columns;

  // Centre placement: bit b is set when the element is connected with its neighbour, of the same piece, at
  // half_neighbourhood[b]. Corner placement: derived from the cells (two elements are connected while a whole
  // cell contains both).
  std::vector<std::uint32_t> connections;  // (n)

  // Cells (m), corner placement only
  // (m x 8) corner a = i + 2 j + 4 k, i, j, k in {0, 1}
  std::vector<std::array<std::uint32_t, 8>> cell_elements;
  std::vector<double> fill;          // (m) share of the voxel inside the part (this piece), in (0, 1]
  std::vector<std::uint8_t> broken;  // (m) 1: fractured, resists no more
  Columns cell_columns;

  // Cells under the surface: polygon p bounds the matter of cells surface_cells[surface_cell_offsets[p] ...
  // surface_cell_offsets[p + 1]), ascending. This distinguishes two pieces of one voxel. Where the matter
  // under a polygon was too little for a cell, the neighbouring cell that it is attached to stands in. Empty
  // for centre placement.
  std::vector<std::uint32_t> surface_cell_offsets;  // (polygons + 1)
  std::vector<std::uint32_t> surface_cells;         // indices of cells

  // Exact moments of the matter of cells that the surface cuts (formats/lattice/cell_moments.h), for model
  // `quadratic`; both are empty unless they were asked for.
  std::vector<std::uint32_t> moment_cells;  // (c) indices of cells, ascending
  std::vector<double> moments;              // (c x kMoments), in units of the voxel's volume

  Surface surface;                           // the part's own mesh, at rest; surface.parts[p] is parts[p]
  std::map<std::string, std::string> notes;  // free text that travels along: "history", "isa", ...

  [[nodiscard]] std::size_t element_count() const { return rest.size(); }
  [[nodiscard]] std::size_t cell_count() const { return cell_elements.size(); }
};

// The 13 directions that, with their opposites, make the 26 neighbours; bit b of Body::connections.
constexpr std::array<Index3, 13> half_neighbourhood = {{{1, 0, 0},
                                                        {-1, 1, 0},
                                                        {0, 1, 0},
                                                        {1, 1, 0},
                                                        {-1, -1, 1},
                                                        {0, -1, 1},
                                                        {1, -1, 1},
                                                        {-1, 0, 1},
                                                        {0, 0, 1},
                                                        {1, 0, 1},
                                                        {-1, 1, 1},
                                                        {0, 1, 1},
                                                        {1, 1, 1}}};

// Part index of each element / of each cell (n), from the parts' ranges.
[[nodiscard]] std::vector<std::uint32_t> element_parts(const Body& body);
[[nodiscard]] std::vector<std::uint32_t> cell_parts(const Body& body);

// The connections as a graph (compressed rows), ascending, both directions. Corner placement: through whole
// (not broken) cells; centre placement: from the bits.
struct Adjacency {
  std::vector<std::uint32_t> offsets;     // (n + 1)
  std::vector<std::uint32_t> neighbours;  // elements
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t element) const {
    return {neighbours.data() + offsets[element], offsets[element + 1] - offsets[element]};
  }
};
[[nodiscard]] Adjacency element_adjacency(const Body& body);

// Sets Body::connections from the cells (corner placement).
void derive_connections(Body& body);

// Sizes agree, ranges tile, indices are in range, numbers are finite, fill in (0, 1], lattices are rotations
// with positive spacing. Throws InputError(where, ...) that names the field.
void check(const Body& body, const std::string& where);

}  // namespace flexel
