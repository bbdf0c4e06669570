// Makes a tessellation fine enough to be deformed: flat faces come with corners on their rims only.
#pragma once
#include <cstddef>

#include "formats/surface.h"

namespace flexel {

// Splits the triangles from `first_polygon` on (all polygons from there must be triangles) until none has an
// edge longer than `largest_edge` [m, above zero], or until they are `most_triangles`; returns whether no
// edge is longer. Neighbours split at the same midpoint, so a closed mesh stays closed and oriented; the
// children of a triangle keep its face and take its place in the order; vertices keep their numbers, new ones
// follow. Midpoints lie on the chords: neither shape nor volume changes.
[[nodiscard]] bool subdivide(Surface& surface, std::size_t first_polygon, double largest_edge,
                             std::size_t most_triangles);

}  // namespace flexel
