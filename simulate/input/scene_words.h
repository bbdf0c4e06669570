// What messages call the parts of a scene: in the words of the command line, where its options made the scene.
#pragma once
#include <string>

namespace flexel::simulate {

constexpr const char* kCommandLine = "the command line";  // the name of such a scene

struct SceneWords {
  const char* a_fix;        // to add
  const char* fix_or_move;  // that is there
  const char* a_finer_size;
};

// `origin`: the scene's name, or where in it something stands ("scene.toml:3", "--push").
[[nodiscard]] inline SceneWords words_of(const std::string& origin) {
  if (origin == kCommandLine || origin.rfind("--", 0) == 0)
    return {"--fix WHERE", "a --fix or --move", "give a smaller --size"};
  return {"a [[fix]]", "a [[fix]] or [[move]]", "voxelize with a smaller spacing"};
}

}  // namespace flexel::simulate
