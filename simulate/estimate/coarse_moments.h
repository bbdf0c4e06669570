// Moments (formats/lattice/cell_moments.h) of the cells of a coarser lattice.
#pragma once
#include <array>

#include "formats/lattice/cell_moments.h"

namespace flexel::simulate {

// Adds to the moments of a coarse cell those of matter in a box that lies in it, from `low` on with edges `size`,
// in units of the coarse cell's edges. `box` holds kMoments moments of it, in units of the box. Exact: on the box, the
// coarse cell's polynomials are of the degree that its own integrate.
void add_box(const double* box, const std::array<double, 3>& low, const std::array<double, 3>& size,
             double* coarse);

}  // namespace flexel::simulate
