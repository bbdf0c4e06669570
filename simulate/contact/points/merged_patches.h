// Patches that the lattice cuts off are joined to their neighbours: where a surface crosses the lattice at an angle
// it has up to three patches a cell's width, though one has the same pressure.
#pragma once
#include <vector>

#include "simulate/contact/points/contact_point.h"

namespace flexel::simulate {

// Faces of one corner-placed part on `lattice`. Smallest first, each joins the nearest larger one that lies on its plane, whose
// cell shares a side with its own, and with which it is no more than a cell's face. That one's cell carries both.
[[nodiscard]] std::vector<ContactPoint> merged_patches(const Lattice& lattice,
                                                       std::vector<ContactPoint> patches);

}  // namespace flexel::simulate
