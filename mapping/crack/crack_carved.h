// What [[event]] carve took away (docs/reference/events.md), as a piece of the part that is left out: the
// surface is parted along the voxels that went, so that the part comes out closed.
#pragma once
#include "formats/lattice/fragments_of_body.h"
#include "mapping/crack/cracked_surface.h"

namespace flexel::mapping {

// True when voxels went and no cell broke.
[[nodiscard]] bool is_carved_cleanly(const Body& body);
// Every part as one fragment, whatever broke in it: close_carved() then only takes away what was carved.
[[nodiscard]] Components whole_parts(const Body& body);

// The surface without what lay over carved matter, with walls (`cap`, as part_surface(); faces "crack") where
// it was. A connected part keeps its name; one that fell apart comes as pieces. `fragments`: of the
// body. Throws as part_surface(), and InputError: a note that is no list of voxels.
[[nodiscard]] CrackedSurface close_carved(const Body& body, const Components& fragments, CrackMode mode);

}  // namespace flexel::mapping
