// The orientation that healing found, for the part's own polygons.
#pragma once
#include <vector>

#include "voxelize/heal/heal.h"

namespace flexel::voxelize {

// Turns polygons of `surface` to face out of the matter, so that selections, loads, contact and reports use
// the orientation that the lattice was made with. Vertices, and number and order of polygons, stay; a turned
// polygon keeps its first corner. parts[p] is surface part p, healed, its mesh in world coordinates. Sets
// `flipped_facets` of parts whose surface stayed open or was wrapped. A polygon that healing removed, unless
// as a duplicate, stays as it was.
void face_outward(std::vector<HealedPart>& parts, Surface& surface);

}  // namespace flexel::voxelize
