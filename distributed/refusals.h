// What flexel-simulate does and several ranks do not.
#pragma once
#include "formats/lattice/body.h"
#include "simulate/effects/effect.h"
#include "simulate/scene/scene.h"

namespace flexel::distributed {

// Each throws InputError naming what it is.
void refuse_unsupported(const simulate::Scene& scene);
void refuse_unsupported(const simulate::Scene& scene, const Body& body);
void refuse_unsupported(const simulate::Scene& scene, const std::vector<simulate::ActiveEffect>& effects);

}  // namespace flexel::distributed
