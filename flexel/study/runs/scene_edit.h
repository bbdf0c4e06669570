// Variants of a scene as TOML for flexel-simulate: another model, solver or step, or one effect left out.
#pragma once
#include <string>
#include <vector>

#include "flexel/study/runs/runner.h"

namespace flexel::study {

// One thing that acts and can be left out.
struct SceneEffect {
  std::string name;       // "gravity", "load 2 (bracket/2)"
  std::string key;        // of the scene: "gravity", "load"
  std::size_t index = 0;  // within an array of tables
};

struct SceneFacts {
  bool timed = false;
  double duration = 0;      // s, of a timed run
  bool own_step = false;    // the scene gives the step
  std::string integrator;   // of a timed run: "symplectic" ...
  double tolerance = 1e-8;  // of equilibrium
  std::vector<std::string> probes;
  std::vector<SceneEffect> effects;
  std::string model;  // of [parts.NAME], where one is given; else ""
};

// What the scene is about. `name` is its file's name for messages. Throws InputError.
[[nodiscard]] SceneFacts scene_facts(const std::string& text, const std::string& name);

// The scene changed as `configuration` says. Files that it names stay those that are meant: paths that are
// relative become relative to `folder`, the scene's own. `parts` are the names of the body's parts. Throws
// InputError: no such effect.
[[nodiscard]] std::string edited_scene(const std::string& text, const std::string& name,
                                       const std::filesystem::path& folder,
                                       const std::vector<std::string>& parts,
                                       const Configuration& configuration);

}  // namespace flexel::study
