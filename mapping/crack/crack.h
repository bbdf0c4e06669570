// Mapping across a fracture: the surface is parted along the boundary between the Voronoi cells of the
// fragments' elements, so that each piece goes with its own elements only (docs/reference/cracks.md).
#pragma once
#include <vector>

#include "formats/lattice/fragments_of_body.h"
#include "mapping/crack/crack_parted.h"
#include "mapping/crack/cracked_surface.h"

namespace flexel::mapping {

// `parted`: cracks that end inside a part are opened up to their ends, where there are any.
// Throws InputError: no surface; `cap` of a part in fragments or with cracks inside whose surface is not
// closed or crosses itself.
[[nodiscard]] CrackedSurface part_surface(const Body& body, const Components& fragments,
                                          const PartedPairs& parted, const CrackOptions& options);
// The same with known anchors of the body's vertices, and shifts that some of them already have.
[[nodiscard]] CrackedSurface part_surface(const Body& body, const Components& fragments,
                                          const PartedPairs& parted, const CrackOptions& options,
                                          VertexAnchors anchors,
                                          std::vector<CrackedSurface::Shift> shifts = {});

// Volumes [m^3] of the pieces that are in the surface, its vertices at `vertices`; 0 of those left out.
[[nodiscard]] std::vector<double> piece_volumes(const CrackedSurface& cracked,
                                                const std::vector<Vec3>& vertices);

}  // namespace flexel::mapping
