// Loads and probes in terms of nodes.
#pragma once
#include <vector>

#include "flexel/export/analysis.h"

namespace flexel::mesh_export {

// The forces [N] (nodes) of a load on the mesh, consistent with the elements' shape functions.
[[nodiscard]] std::vector<Vec3> nodal_forces(const simulate::Load& load, const AnalysisMesh& mesh,
                                             const simulate::Problem& problem);

// The mean over a selection, or a point, in terms of nodes. Hexahedra: as in a Flexel run. Tetrahedra: the
// mean over the area of the selected faces, and of a point its nearest node. Throws InputError: nothing
// there.
[[nodiscard]] AnalysisProbe place_probe(const simulate::Probe& probe, const AnalysisMesh& mesh,
                                        const simulate::Problem& problem);

}  // namespace flexel::mesh_export
