// The keys of a scene: what a reference page, the completion and "did you mean" are made from. Those of an
// effect stand in its row (simulate/scene/effects.cpp), the general ones in scene_keys.cpp.
#pragma once
#include <string>
#include <vector>

#include "simulate/input/scene_table.h"
#include "simulate/scene/scene_key.h"

namespace flexel::simulate {

// A row of the reference: an effect, or a general table.
struct SceneKeyGroup {
  std::string name, help;
  std::string acts, models;  // of effects; else ""
  std::vector<SceneKey> keys;
};

// All groups: the general ones, then the effects in the order of their rows.
[[nodiscard]] std::vector<SceneKeyGroup> scene_key_groups();

// "force, a vector": what a key takes, for people.
[[nodiscard]] std::string value_of(const SceneKey& key);

// Throws InputError for the first key in a table of the scene that no group has, with the nearest one.
void refuse_unknown_keys(const SceneValue& scene, const std::string& file);

}  // namespace flexel::simulate
