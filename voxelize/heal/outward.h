// The orientation that healing found, for the part's own polygons.
#pragma once
#include <vector>

#include "voxelize/heal/heal.h"

namespace flexel::voxelize {

// Turns polygons of `surface` so that they face out of the matter: what selections, loads, contact and
// reports take for outward is then what the lattice was made by. Vertices, and the number and order of
// polygons, stay; a turned polygon keeps its first corner. parts[p] is surface part p, healed, its mesh in
// world coordinates; `flipped_facets` of a part whose surface stayed open, or was wrapped, is set. A polygon
// that healing left out and that repeats no other stays as it was.
void face_outward(std::vector<HealedPart>& parts, Surface& surface);

}  // namespace flexel::voxelize
