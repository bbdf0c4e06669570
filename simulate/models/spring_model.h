// Model `springs`: what one cell resists with as 28 central springs between its elements (the connections of
// Jansson and Vergeest, equation 3, without damping), stiff enough for the material's Young's modulus. Free
// functions on one cell; simulate/models/cells.h puts them together over a body.
//
// A lattice with springs k_face, k_edge, k_corner along its 26 neighbours has C11 = (k_face + 2 k_edge + 4/3
// k_corner) / h and C12 = C44 = (k_edge + 4/3 k_corner) / h. It is isotropic, with Poisson's ratio 1/4
// always, if k_face = k_edge + 8/3 k_corner; Young's modulus E then needs, for any 0 <= t < 0.3,
//     k_face = (2/5 + 4t/3) E h,   k_edge = (2/5 - 4t/3) E h,   k_corner = t E h
// (t = 0.3 has a motion without energy; here t = 0.1). A connection along an edge of the cells belongs to
// four of them, one across a face to two: each cell holds its share.
#pragma once
#include "simulate/models/cell_model.h"

namespace flexel::simulate {

struct Spring {
  std::size_t a = 0, b = 0;  // corners, a < b
  double stiffness = 0;      // N/m, this cell's share
  Vec3 rest = Vec3::Zero();  // m, from a to b, world frame
  double flowed = 0;         // m, change of the rest length |rest|
};

// Springs of all cells of a part. The lattice must be cubic.
struct SpringKind {
  std::array<Spring, 28> springs;
};
[[nodiscard]] SpringKind spring_kind(const Lattice& lattice, const Material& material);

// Of a whole cell with fill 1: energy 1/2 k (|r| - |rest| - flowed)^2 [J]; forces on the elements [N].
[[nodiscard]] double cell_energy(const SpringKind& kind, const CellVectors& displacement);
[[nodiscard]] CellVectors cell_forces(const SpringKind& kind, const CellVectors& displacement);

// d2U/du_b du_b = d2U/du_a du_a = -d2U/du_a du_b of one spring [N/m]. With `project` without the negative
// part that compression brings.
[[nodiscard]] Block spring_block(const Spring& spring, const CellVectors& displacement, bool project);

}  // namespace flexel::simulate
