// How near the parts are to what their materials bear.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/input/materials.h"

namespace flexel::simulate {

struct Scene;  // simulate/scene/scene.h

struct StrengthSummary {   // of the part that is nearest to what its material bears
  double share = 0;        // stress / limit
  double stress = 0;       // Pa, von Mises
  Vec3 at = Vec3::Zero();  // m, rest position
  double limit = 0;        // Pa
  bool yields = false;     // there; else it breaks
  std::string part, material;
  std::optional<double> layer_share = {};  // of the strength of a print across its layers
  std::vector<std::string> too_weak = {};  // parts whose nearest_share() is above 1

  [[nodiscard]] double nearest_share() const;  // along the layers or across them
};

// Whether an edit changed what cells of the part bear, by "stiffness", "yield" or "strength"
// (docs/reference/events.md): shares of what the material bears would then say nothing.
[[nodiscard]] bool has_edited_limits(const Body& body, const Part& part);

// The part whose largest von Mises stress (column "von_mises" of the elements) is the greatest share of its
// material's yield stress or strength, whichever is less, or of what a print bears across its layers. Nothing where no part has
// either, or no stresses. `materials` (parts). `unknown` gets the names of materials that have neither, of those
// of parts with edited limits, and of parts of model `paper`, which has no stresses.
[[nodiscard]] std::optional<StrengthSummary> nearest_to_strength(const Body& body,
                                                                 const std::vector<Material>& materials,
                                                                 std::vector<std::string>& unknown);

// The materials of the deformed body's parts. Where events brought parts that the scene gives no material,
// only names are known. Never throws InputError.
[[nodiscard]] std::vector<Material> known_materials(const Scene& scene, const Body& body);

}  // namespace flexel::simulate
