// Parts that join a timed run are bonded where they touch, as they all are at that moment (docs/reference/events.md,
// "add"): what Bonds is for parts that touch at rest.
//
// Points x of the finer part's surface, where they are now, are led back to X in the other part at rest, by Newton's
// method on what carries them there. They touch where X is as near to a polygon of that part as parts that touch at rest
// are (simulate/matter/interface_points.h) and the two surfaces face each other within 45 degrees now. Each becomes a point
// that holds sum w x = sum w' x' with the weights of either side: no force at that moment, none by a rigid motion of both,
// and momentum and angular momentum are kept. Its stiffness is that of Bonds.
#pragma once
#include "formats/lattice/fused_points.h"
#include "simulate/effects/bonds.h"

namespace flexel {
class Progress;
}

namespace flexel::simulate {

// Of parts from number `first` on, which have just joined, with all the others and each other: those that
// `bonds` bonds. Pairs that have points in `fused` already are left out. Warns of parts of model `paper` that
// are one element thick where another is near: neighbours do not tell where the surface of those is, and they
// are not bonded. Throws InputError: parts that a [[bond]] names do not touch.
[[nodiscard]] std::vector<FusedPoint> joined_bonds(const Problem& problem, const State& state,
                                                   std::uint32_t first, const Bonds::Parameters& bonds,
                                                   const std::vector<FusedPoint>& fused, Progress& progress);

}  // namespace flexel::simulate
