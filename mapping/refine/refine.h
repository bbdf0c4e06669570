// Splits the triangles of a surface that are too large to show how it is deformed.
#pragma once
#include "formats/lattice/body.h"
#include "formats/part/refinement.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// Once a triangle is coarse (chord.h), the surface is split until no triangle with an edge of over two spacings
// misses more than this share of the largest displacement, which is what the edge that the report names leaves too
// (sufficient_edge()), nor this share of a spacing. The second is for thin walls that move by many times their thickness:
// both their sides stay where the wall is.
constexpr double kRefinedShare = 0.0025, kRefinedSpacings = 0.25;
// And until none is turned by more than 15 degrees against the matter at its middle: across a needle of a triangle even a
// small distance from the plane is much.
constexpr double kRefinedFacing = 0.966;  // cosine

struct RefinedWhereCoarse {
  Refinement refinement;
  bool ended = true;  // false: kMostTriangles came first
};

// `result`: of the surface as it is; `largest_displacement`: ChordError has it, m. Neighbours split at the same midpoint.
// A midpoint far outside the lattice is no reason to split.
[[nodiscard]] RefinedWhereCoarse refine_where_coarse(const Body& body, const MapResult& result,
                                                     double largest_displacement);

// Until no edge is longer than `edge` [m, above zero]. Throws InputError: that takes more than kMostTriangles.
[[nodiscard]] Refinement refine_to_edge(const Surface& surface, double edge);

// Puts `surface`, the body's own with its polygons split, in its place. The pieces of a polygon name those of its
// cells that are near them.
void take_refined(Body& body, Surface surface, const Refinement& refinement);

}  // namespace flexel::mapping
