// Volume and thinnest wall of a part, without a lattice.
#pragma once
#include <vector>

#include "formats/part/surface.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

// Heals every part as the voxelizer does (Heal::automatic), turns the polygons of `surface` outward
// (outward.h), and measures: the volume, and the thinnest wall along rays through the surface on a grid of
// `rays` lines per axis (fewer where there are many parts, wall_lines()): distance between an entry and the next exit whose normals oppose each other, times
// the cosine to the ray.
[[nodiscard]] std::vector<MeasuredPart> heal_and_measure(Surface& surface, int rays = 256);

}  // namespace flexel::voxelize
