// Parts that events will bring, of which a scene may speak from its beginning on.
#pragma once
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// What the scene says of effects, its loads and supports without the parts which are to come and that the body does not
// have yet: what else they select stays, and without that they are left out.
[[nodiscard]] EffectParameters without_coming_parts(const Scene& scene, const Body& body);
// The scene as it is for the body that it begins with; its events read what they need.
[[nodiscard]] Scene at_the_beginning(const Scene& scene, const Body& body);

}  // namespace flexel::simulate
