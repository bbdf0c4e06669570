// Makes a tessellation fine enough to be deformed: flat faces come with corners on their rims only.
#pragma once
#include <cstddef>
#include <string>

#include "formats/part/surface.h"

namespace flexel {

// No file becomes more triangles by subdivision.
constexpr std::size_t kMostTriangles = 2'000'000;

// Splits the triangles from `first_polygon` on (all polygons from there must be triangles) until none has an
// edge longer than `largest_edge` [m, above zero], or until they are `most_triangles`; returns whether no
// edge is longer. Neighbours split at the same midpoint, so a closed mesh stays closed and oriented; the
// children of a triangle keep its face and its columns and take its place in the order; vertices keep their
// numbers, new ones follow, with the mean of the columns of the two ends. Midpoints lie on the chords:
// neither shape nor volume changes.
[[nodiscard]] bool subdivide(Surface& surface, std::size_t first_polygon, double largest_edge,
                             std::size_t most_triangles);
// The same, as far as it has to go. Throws InputError(where, ...): `largest_edge` is not above zero, or more
// than kMostTriangles would be needed.
void subdivide(Surface& surface, std::size_t first_polygon, double largest_edge, const std::string& where);

// The same for a whole mesh, whose polygons become triangles first. Where no edge is longer, of its triangles
// either, nothing changes; else the file that it came from does not hold it any more and
// SurfaceSource::bytes are dropped: it is written as a new file.
void subdivide_mesh(Surface& surface, double largest_edge, const std::string& where);

}  // namespace flexel
