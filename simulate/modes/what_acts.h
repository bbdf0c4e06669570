// What a run of modes or of buckling knows of a scene, and what it does not.
#pragma once
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Whether anything of a scene moves the body.
[[nodiscard]] bool drives(const std::vector<ActiveEffect>& effects);

// Throws InputError naming what of a scene a run of modes or buckling does not have.
void refuse_what_modes_lack(const Scene& scene, const std::vector<ActiveEffect>& effects);

// Throws DivergedError: under the scene's loads the stiffness is not positive.
[[noreturn]] void refuse_buckled(const std::string& scene);

}  // namespace flexel::simulate
