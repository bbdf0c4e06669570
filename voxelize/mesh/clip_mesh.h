// A closed mesh cut to a box, and closed again.
#pragma once
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// What of a balanced mesh, placed on a lattice, lies in a box of lattice coordinates. On each face of the box it is closed by the
// cone over the section's boundary to one point of that face: triangles that overlap, but as signed areas add up to the section, so
// winding numbers inside the box are those of the whole mesh. The faces are to keep clear of vertices. Fills `world`, `vertices`,
// `corners`, `polygon` (kNoPolygon of what closes it) and the numbers of edges and shells.
[[nodiscard]] PartMesh clipped_to_box(const PartMesh& mesh, const Lattice& lattice, const Vec3& lower,
                                      const Vec3& upper);

}  // namespace flexel::voxelize
