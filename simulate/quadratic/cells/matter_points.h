// Loads on elements in model `quadratic`: what each element stands for of the matter.
#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "simulate/matter/load_distribution.h"
#include "simulate/quadratic/cells/cell_integrals.h"
#include "simulate/quadratic/cells/quadratic_nodes.h"

namespace flexel::simulate {

// A force f on it is the force per volume f N_e / |N_e|, where N_e is the element's trilinear shape function and |N_e| its
// integral over the matter, which is what model `cells` lumps at the element.
struct MatterPoint {
  LoadedPoint point;                                       // the middle of N_e; |N_e| [m^3]
  std::vector<std::pair<std::uint32_t, double>> carriers;  // nodes, ascending, and their shares; the sum is 1
};

// Of those of the elements (ascending) that hold matter. `moments`, `lattice`: of the cell of that index in nodes.cells.
[[nodiscard]] std::vector<MatterPoint> matter_points(
    const Body& body, const QuadraticNodes& nodes, const std::vector<std::uint32_t>& elements,
    const std::function<Moments(std::size_t)>& moments,
    const std::function<const Lattice&(std::size_t)>& lattice);

}  // namespace flexel::simulate
