// Faces of different parts that touch.
#pragma once
#include <vector>

#include "flexel/export/analysis.h"

namespace flexel::mesh_export {

// CAD faces of different parts that lie on one another, within `tolerance` [m], facing each other.
[[nodiscard]] std::vector<TiedFaces> touching_faces(const AnalysisMesh& mesh, double tolerance);

}  // namespace flexel::mesh_export
