// Held and loaded regions that the lattice does not resolve.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "simulate/scene/scene.h"

namespace flexel::simulate {

// The width [m] of a region of the surface where matter that is not held goes on beside it, flush or rising,
// along more than a third of its rim (a ring around a screw, a patch of a face): twice its area over the length
// of its rim, which is exact for rings and long strips, half the side of a square and the radius of a disc.
// Nothing where it ends at outer edges, as the end of a bar does, or has no rim. `polygons`: numbers,
// ascending; `held`: likewise of all that is held, those and the other half of a hole that a file splits.
[[nodiscard]] std::optional<double> width_amid_matter(const Surface& surface,
                                                      const std::vector<std::uint32_t>& polygons,
                                                      const std::vector<std::uint32_t>& held);

// The first fix, move or rigid link whose region is so narrow that less than two cells lie across that width,
// in words; "" for none. How far such a support gives way comes slowly to its limit, while values on three lattices seem to close
// in on another.
[[nodiscard]] std::string support_under_two_cells(const Body& body, const Scene& scene);

// How far the surface gives way under a force or a pressure on such a region, as far as cells that wide spread it.
struct UnresolvedIndentation {
  std::string load;                     // its name
  std::vector<std::uint32_t> polygons;  // that it acts on, ascending
  double width = 0;                     // m, width_amid_matter()
  // m, of the centre of a square of that area on a half-space under an even pressure, 1.122 (1 - nu^2) F / (E sqrt(area))
  // (Love, Phil. Trans. R. Soc. A 228, 1929), times spacing / (width + spacing)
  double depth = 0;
};

// Of the forces and pressures on faces, groups and sides whose regions are under two cells wide.
[[nodiscard]] std::vector<UnresolvedIndentation> indentations_under_two_cells(const Body& body,
                                                                              const Scene& scene);

}  // namespace flexel::simulate
