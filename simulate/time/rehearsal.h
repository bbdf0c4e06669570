// Runs in which a part changes its resolution: what would stop them at the event is found before they begin.
#pragma once
#include "formats/lattice/body.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Changes the lattices of a copy of `body`, at rest, as the events of the scene will, and looks on each for
// what the scene names; nothing where no event changes a lattice. Throws InputError: an effect or another
// event of the scene, or tools that are led while it runs (`live`), cannot be carried to another lattice; a
// lattice has no room in memory; what a fix, load, bond or probe names is not there on one of them.
void rehearse_resolution(const Body& body, const Scene& scene, bool live);

}  // namespace flexel::simulate
