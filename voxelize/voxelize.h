// Surface -> Body: inside and outside, fill fractions, pieces, lattice.
#pragma once
#include "base/program/progress.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel::voxelize {

// Voxelises every part of `surface`, which is moved into the body, its polygons turned outward (outward.h).
// Throws InputError: no size that fits the part (a spacing larger than it), nothing inside, memory beyond the
// limit (before allocating), two parts that are one body in one place.
[[nodiscard]] VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress);

// Heals every part as the voxelizer does (Heal::automatic), turns the polygons of `surface` outward
// (outward.h), and measures: the volume, and the thinnest wall along rays through the surface on a grid of
// `rays` lines per axis: distance between an entry and the next exit whose normals oppose each other, times
// the cosine to the ray.
[[nodiscard]] std::vector<MeasuredPart> heal_and_measure(Surface& surface, int rays = 256);

}  // namespace flexel::voxelize
