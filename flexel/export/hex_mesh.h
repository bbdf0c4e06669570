// The lattice as a mesh of hexahedra.
#pragma once
#include "flexel/export/mesh.h"

namespace flexel::mesh_export {

// The sound cells of the problem's body. A cell whose fill is below 1 goes to one of 20 classes of 0.05 a
// part, whose stiffness and density are those of the material times the mean fill: the mass is the part's
// own.
[[nodiscard]] AnalysisMesh hexahedra(const simulate::Problem& problem);

}  // namespace flexel::mesh_export
