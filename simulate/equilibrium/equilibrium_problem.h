// What is solved at equilibrium, and what vibrates about it: a body by its elements.
#pragma once
#include "simulate/matter/fragments.h"
#include "simulate/models/cells.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Keeps a reference to `body`. Loose crumbs are carried along, and so are elements at tips and edges that no connection holds
// (unsupported_elements()), which are added to `unsupported`.
[[nodiscard]] Problem equilibrium_problem(const Body& body, const Scene& scene, const Fragments& fragments,
                                          std::size_t& unsupported);

}  // namespace flexel::simulate
