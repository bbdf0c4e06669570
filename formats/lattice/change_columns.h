// Columns of a body that change what it is made of, place by place (docs/reference/body-file.md): 0 is no change, and nearly all
// are factors less 1.
#pragma once
#include <array>

namespace flexel {

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

}  // namespace flexel
