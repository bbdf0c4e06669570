// Names of the columns that a run leaves in a body of the stresses that it found (docs/theory/stress.md): of the elements,
// of the cells with "cell_" before, and of the surface's vertices where the model knows them there.
#pragma once
#include "formats/lattice/quadratic_field.h"

namespace flexel {

constexpr const char* kVonMisesColumn = "von_mises";          // Pa
constexpr const char* kPrincipalColumn = "principal_stress";  // Pa, 3, descending
constexpr const char* kYieldColumn =
    "yield_share";  // of the material's `yield`; -1 where it has none. Vertices only

// Whether a run (of model `quadratic`) left stresses at the surface's vertices: then columns of these names there are not the
// part's own.
[[nodiscard]] inline bool has_surface_stress(const Body& body) {
  return body.cell_columns.contains(kQuadraticColumn) && body.element_columns.contains(kVonMisesColumn) &&
         body.surface.vertex_columns.contains(kVonMisesColumn);
}

inline void erase_surface_stress(Columns& vertices) {
  for (const char* name : {kVonMisesColumn, kPrincipalColumn, kYieldColumn}) vertices.erase(name);
}

}  // namespace flexel
