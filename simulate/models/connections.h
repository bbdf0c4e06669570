// Connections of the centre-placed parts (model `paper`): central springs between neighbouring elements.
//
// Two connected elements at a distance d attract each other with k (d - l), l their distance at rest (Jansson
// and Vergeest, equations 2 and 15). The Hooke constant k follows from Young's modulus E and the spacing h:
//     paper      k = E l (equation 22): E h, sqrt(2) E h, sqrt(3) E h along a face, edge, corner of the voxel
//     ganovelli  k = sum over tetrahedra of E V / l^2 (equation 21; Ganovelli, Cignoni, Montani and Scopigno
//                2000), each cube of eight elements cut into the six Kuhn tetrahedra about a diagonal and
//                averaged over its four diagonals: E h, E h / 6, E h / 12
//     isotropic  those of model `springs` (simulate/models/spring_model.h): every direction has Young's modulus E
//                and Poisson's ratio 1/4
// Every connection has the value of the interior, also at the surface.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "simulate/state/state.h"

namespace flexel::simulate {

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

// Elastic constants of the endless lattice, over the material's Young's modulus: C11 = (k1 + 2 k2 + 4/3 k3) / h and
// C12 = C44 = (k2 + 4/3 k3) / h (Cauchy: central forces).
struct LatticeConstants {
  double c11 = 0, c12 = 0;
};
[[nodiscard]] LatticeConstants lattice_constants(HookeConstant hooke);
// Young's modulus along an axis of the lattice, over that of the material: C11 - 2 C12^2 / (C11 + C12).
[[nodiscard]] double axial_stiffness(HookeConstant hooke);

// The connections of the body's centre-placed parts (Body::connections); none of stray elements.
[[nodiscard]] Connections make_connections(const Problem& problem);

// The connections at each element (compressed rows), ascending by the other element.
struct ConnectionRows {
  struct Entry {
    std::uint32_t other = 0;
    std::uint8_t kind = 0;
    std::int8_t sign = 1;  // the kind's rest vector times sign leads to `other`
  };
  std::vector<std::uint32_t> offsets;  // (elements + 1)
  std::vector<Entry> entries;          // (2 connections)
  [[nodiscard]] std::span<const Entry> of(std::uint32_t element) const {
    return {entries.data() + offsets[element], offsets[element + 1] - offsets[element]};
  }
};
[[nodiscard]] ConnectionRows connection_rows(const Connections& connections, std::size_t elements);

}  // namespace flexel::simulate
