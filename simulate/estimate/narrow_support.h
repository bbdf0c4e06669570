// Held regions that the lattice does not resolve.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "simulate/scene/scene.h"

namespace flexel::simulate {

// The width [m] of a region of the surface where matter goes on beside it, flush or rising, along more than a
// third of its rim (a ring around a screw, a patch of a face): twice its area over the length of its rim, which
// is exact for rings and long strips and half the side of a square. Nothing where it ends at outer edges, as
// the end of a bar does, or has no rim. `polygons`: numbers, ascending.
[[nodiscard]] std::optional<double> width_amid_matter(const Surface& surface,
                                                      const std::vector<std::uint32_t>& polygons);

// The first fix or move whose region is so narrow that less than two cells lie across it, in words; "" for
// none. How far such a support gives way comes slowly to its limit, while values on three lattices seem to close
// in on another.
[[nodiscard]] std::string support_under_two_cells(const Body& body, const Scene& scene);

}  // namespace flexel::simulate
