// Parts that events will bring, of which a scene may speak from its beginning on.
#pragma once
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// What the scene says of effects, its loads, supports and bonds without the parts which are to come and that the body does not
// have yet: what else they select stays, and without that they are left out.
[[nodiscard]] EffectParameters without_coming_parts(const Scene& scene, const Body& body);
// Its probes likewise; those of which nothing is there yet have neither `at` nor `where`.
[[nodiscard]] std::vector<Probe> without_coming_probes(const Scene& scene, const Body& body);
// The scene as it is for the body that it begins with; its events read what they need.
[[nodiscard]] Scene at_the_beginning(const Scene& scene, const Body& body);

}  // namespace flexel::simulate
