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

// Counts a piece and its matter; `kept`: it becomes something.
void add_piece(double fill, bool kept, AssembledPart& found);

// The cells that bound each polygon, as (polygon, cell) pairs by cell; cells are numbered over the body.
struct PolygonCell {
  std::uint32_t polygon = 0, cell = 0;
};
using PolygonCells = std::vector<std::vector<PolygonCell>>;  // a list for each slab of each part

// A part of which the body gets some cells alone: `voxels` has at least four layers more on either side, so that all is
// as it would be among all of them.
struct PartSlice {
  VoxelBox held;  // the voxels that become cells
  VoxelBox own;   // of them those that do in no other slice
  int axis = 0;   // the part is cut across this one
  // (planes across the axis, from `first_plane`) The number of its first element over the whole lattice.
  int first_plane = 0;
  std::vector<std::int64_t> plane_point;
  std::vector<std::int64_t> points;  // of each element that the body got, its number is appended
};

// Appends one part's elements (corner placement: and cells) to the body and sets the part's ranges. `part`
// has its lattice and placement. The cells under polygons are appended to `polygon_cells` (corner placement).
AssembledPart assemble_part(const Voxels& voxels, const Part& part, Body& body, PolygonCells& polygon_cells,
                            PartSlice* slice = nullptr);

// Sets rest and position of the last part's elements. assemble_part does it, but for a slice: there whoever calls it does
// so once the voxels, which take as much memory, are gone.
void place_elements(const Part& part, Body& body);

// Fills surface_cell_offsets and surface_cells from the pairs of all parts; `polygons`: of the surface.
void set_surface_cells(const PolygonCells& polygon_cells, std::size_t polygons, Body& body);

}  // namespace flexel::voxelize
