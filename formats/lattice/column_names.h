// Names of columns and notes of a body that more than one stage knows (docs/reference/body-file.md): changes of what it is
// made of, the stresses that a run found, and what its lattice does not resolve.
#pragma once
#include <array>

#include "formats/lattice/quadratic_field.h"

namespace flexel {

// Changes of what it is made of, place by place: 0 is no change, and nearly all are factors less 1.
enum class ChangeOf {
  matter,      // of cells where the elements are at the voxels' corners, else of elements
  elements,    // wherever they are
  radius,      // of elements at the voxels' centres
  connections  // of those too: 13 numbers an element
};

struct ChangeColumn {
  const char* name;
  ChangeOf of;
};

inline constexpr std::array<ChangeColumn, 12> kChangeColumns{
    {{"stiffness_change", ChangeOf::matter},
     {"damping_change", ChangeOf::matter},
     {"density_change", ChangeOf::matter},
     {"strength_change", ChangeOf::matter},
     {"yield_change", ChangeOf::matter},
     {"friction_change", ChangeOf::elements},
     {"stick_change", ChangeOf::elements},
     {"radius_change", ChangeOf::radius},
     {"connection_stiffness_change", ChangeOf::connections},
     {"connection_damping_change", ChangeOf::connections},
     {"connection_strength_change", ChangeOf::connections},
     {"connection_friction_change", ChangeOf::connections}}};

// Stresses that a run found (docs/theory/stress.md): of the elements, of the cells with "cell_" before, and of the surface's
// vertices where the model knows them there.
constexpr const char* kVonMisesColumn = "von_mises";          // Pa
constexpr const char* kPrincipalColumn = "principal_stress";  // Pa, 3, descending
constexpr const char* kYieldColumn =
    "yield_share";  // of the material's `yield`; -1 where it has none. Vertices only

// Notes: what of the parts' shape the lattice does not have, a line for each part. No error bar counts it, for coarser lattices have
// it no more. Walls thinner than a cell, which model `quadratic` has; and voxels whose pieces were taken as one.
constexpr const char* kLostWallsNote = "lost_walls";
constexpr const char* kJoinedPiecesNote = "joined_pieces";

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
