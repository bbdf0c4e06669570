// Writes a scene as the TOML that flexel-simulate reads.
#pragma once
#include <string>

#include "simulate/scene/scene.h"

namespace flexel::commands {

struct SceneText {
  std::string keys;  // of the top level, which TOML takes before all tables
  std::string tables;
};

// What options can add to a scene (flexel/job.h), in TOML and SI units: the default material and infill,
// those of parts, fixes, moves, loads (a bearing load with its force), probes and the acceleration of
// gravity. All else is left out.
[[nodiscard]] SceneText scene_text(const simulate::Scene& scene);

}  // namespace flexel::commands
