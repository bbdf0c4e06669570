// A scene in the terms of a finite element program.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/export/analysis.h"

namespace flexel::mesh_export {

// Throws InputError naming what of the scene has no translation: a timed run, events, effects other than
// gravity, loads, fixes, moves and bonds. `problem` is that of a lattice of the part.
void refuse_untranslatable(const simulate::Scene& scene, const simulate::Problem& problem);

// Models other than `cells` are dropped from the scene's parts; a line for each.
[[nodiscard]] std::vector<std::string> drop_models(simulate::Scene& scene);

// Translates a scene that refuse_untranslatable() let pass. `problem` is that of the mesh's body. What
// differs from the scene is added to the warnings. Throws InputError: selections that select nothing.
[[nodiscard]] Analysis translate(AnalysisMesh mesh, const simulate::Scene& scene,
                                 const simulate::Problem& problem);

// Whether leaving large rotations out would change the largest displacement of the part by over a percent:
// from a coarse lattice of ours under the scene's loads and under a thousandth of them. In `why` how that was
// told, or why it could not be.
[[nodiscard]] bool large_deflection(const Surface& surface, simulate::Scene scene, int threads,
                                    std::string& why, Progress& progress);

}  // namespace flexel::mesh_export
