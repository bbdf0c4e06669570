// Recognises meaningless part names, such as "COMPOUND" or "mesh_0".
#pragma once
#include <string>

namespace flexel {

// Whether a file's name for a part is only what its writer puts there for want of one: a kind of shape,
// numbered or not ("COMPOUND", "mesh_0", "Solid-2"), or the writer's own name ("Open CASCADE STEP
// translator 7.6 1", "Exported from Blender-2.80"). Such parts go by the name of their file.
[[nodiscard]] bool says_nothing(const std::string& name);

}  // namespace flexel
