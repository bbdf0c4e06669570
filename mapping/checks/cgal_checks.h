// The checks of --check, by CGAL.
#pragma once
#include "formats/lattice/body.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// Of the surface of `body`, whose corners at equal positions are one. `displacement`: (vertices x 3) m, finite.
[[nodiscard]] SurfaceMeetings new_meetings(const Body& body, const std::vector<Vec3>& displacement);

// (elements of the body) 1: the element holds a vertex and its neighbours in the Voronoi diagram of its
// part's elements have changed. Neighbours are those whose common facet is larger than 5 % of the spacing
// squared, so that the ties of a lattice (facets that are a line or a point) do not count. Of a facet counts
// what lies within 1.5 spacings of the middle of the two: those at the rim of the part have no end.
[[nodiscard]] std::vector<std::uint8_t> voronoi_changes(const Body& body, const MapResult& result);

}  // namespace flexel::mapping
