// Connections of the centre-placed parts (model `paper`): central springs between neighbouring elements.
//
// Two connected elements at a distance d attract each other with k (d - l), l their distance at rest (Jansson
// and Vergeest, equations 2 and 15). The Hooke constant k follows from Young's modulus E and the spacing h:
//     paper      k = E l (equation 22): E h, sqrt(2) E h, sqrt(3) E h along a face, edge, corner of the voxel
//     ganovelli  k = sum over tetrahedra of E V / l^2 (equation 21; Ganovelli, Cignoni, Montani and Scopigno
//                2000), each cube of eight elements cut into the six Kuhn tetrahedra about a diagonal and
//                averaged over its four diagonals: E h, E h / 6, E h / 12
// Every connection has the value of the interior, also at the surface.
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/state.h"

namespace flexel {

struct ConnectionKind {
  double stiffness = 0;      // N/m, k
  double length = 0;         // m, l
  Vec3 rest = Vec3::Zero();  // m, from a to b, world frame
};

// Kinds by direction: kind 1 + b is that of half_neighbourhood[b]; kind 0 is absent (no stiffness).
using ConnectionKinds = std::array<ConnectionKind, 1 + half_neighbourhood.size()>;

struct PartConnections {
  std::uint32_t begin = 0, end = 0;  // range of connections
  ConnectionKinds kinds;
};

// Every connection once. Columns, ascending by (a, b); those of a part are contiguous.
struct Connections {
  std::vector<std::uint32_t> a, b;     // (connections) elements, a < b
  std::vector<std::uint8_t> kind;      // (connections) index into its part's kinds
  std::vector<PartConnections> parts;  // (parts); none for a corner-placed part
  [[nodiscard]] std::size_t size() const { return kind.size(); }
};

// The kinds of a cubic lattice.
[[nodiscard]] ConnectionKinds connection_kinds(const Lattice& lattice, const Material& material,
                                               HookeConstant hooke);

// The connections of the body's centre-placed parts (Body::connections); none of stray elements.
[[nodiscard]] Connections make_connections(const Setting& setting);

}  // namespace flexel
