// Attributes of the mapped vertices, as columns of the surface.
#pragma once
#include "formats/lattice/body.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// (vertices) displacement (3 components, m), stretch, frame_kind, distance_outside (spacings), rest_residual
// (m), inverted, degenerate, voronoi_cell_left and, where it was checked, voronoi_changed (docs/reference/mapping.md); and the stresses that a run left at the vertices.
// `surface`: what was mapped, at rest.
[[nodiscard]] Columns vertex_attributes(const Surface& surface, const Body& body, const MapResult& result);

// Writes the deformed surface as .vtu: polygons as cells, the part as cell data, attributes as point data;
// coordinates in `unit` metres.
void write_surface_vtu(const Surface& surface, const std::vector<Vec3>& displacement,
                       const Columns& attributes, double unit, const std::string& path);

}  // namespace flexel::mapping
