// Voxels -> elements and cells of the body.
#pragma once
#include "formats/lattice/body.h"
#include "voxelize/classify/voxels.h"

namespace flexel::voxelize {

struct AssembledPart {
  std::size_t cells = 0, elements = 0;
  std::size_t dropped_cells = 0;
  double volume = 0, dropped_volume = 0;  // in voxels
};

// The cells that bound each polygon, as (polygon, cell) pairs by cell; cells are numbered over the body.
struct PolygonCell {
  std::uint32_t polygon = 0, cell = 0;
};
using PolygonCells = std::vector<std::vector<PolygonCell>>;  // a list for each slab of each part

// Appends one part's elements (corner placement: and cells) to the body and sets the part's ranges. `part`
// has its lattice and placement. The cells under polygons are appended to `polygon_cells` (corner placement).
AssembledPart assemble_part(const Voxels& voxels, const Part& part, Body& body, PolygonCells& polygon_cells);

// Fills surface_cell_offsets and surface_cells from the pairs of all parts.
void set_surface_cells(const PolygonCells& polygon_cells, Body& body);

}  // namespace flexel::voxelize
