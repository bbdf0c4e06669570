// Surface -> Body: inside and outside, fill fractions, pieces, lattice.
#pragma once
#include <functional>

#include "base/program/progress.h"
#include "voxelize/types/options.h"
#include "voxelize/types/result.h"

namespace flexel {
struct PieceBody;  // formats/pieces/pieces.h
}

namespace flexel::voxelize {

// Voxelises every part of `surface`, which is moved into the body, its polygons turned outward (outward.h).
// Throws InputError: no size that fits the part (a spacing larger than it), nothing inside, memory beyond the
// limit (before allocating), moments at centre placement, two parts that are one body in one place.
[[nodiscard]] VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress);

// Likewise, but the lattice is never there as a whole: its `options.pieces` pieces are given to `use` one after another, and
// the body that comes back has the surface and the parts' lattices alone (as `whole` has). Throws InputError beside: centre
// placement, a surface that stays open, a part with fewer layers of cells along its longest axis than pieces.
using UsePiece = std::function<void(Body& whole, PieceBody& piece)>;
[[nodiscard]] VoxelizeResult voxelize_pieces(Surface surface, const VoxelizeOptions& options,
                                             const UsePiece& use, Progress& progress);

}  // namespace flexel::voxelize
