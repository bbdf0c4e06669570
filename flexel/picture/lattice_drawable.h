// The lattice of a body as something to draw.
#pragma once
#include "flexel/picture/render/drawable.h"
#include "formats/lattice/body.h"

namespace flexel::picture {

// The faces of cells that no other cell shares, two triangles each, with the cells' edges as borders; broken
// cells are left out (unless there are no others).
// Vertices are the elements, at `positions` (m); `cell` (triangles) is the cell each triangle belongs to.
struct CellHull {
  Drawable drawn;
  std::vector<std::uint32_t> cell;
};
[[nodiscard]] CellHull draw_cells(const Body& body, const std::vector<Vec3>& positions,
                                  const DrawingFrame& frame);

// Every element as a sphere of radius 0.45 spacings.
[[nodiscard]] Drawable draw_elements(const Body& body, const std::vector<Vec3>& positions,
                                     const DrawingFrame& frame);

}  // namespace flexel::picture
