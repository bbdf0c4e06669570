// What an elastic law needs to know of a material, as plain data: the kernels of timed runs include this. Each
// law is a header of this folder; simulate/laws/elasticity.h is the seam that everything else calls. docs/theory/laws.md
// has the equations, and what a further law needs.
#pragma once
#include <cstdint>

namespace flexel::simulate {

enum class LawName : std::uint8_t { neo_hooke, mooney_rivlin, arruda_boyce, orthotropic };

// In the frame in which deformation gradients are given.
struct Law {
  LawName name = LawName::neo_hooke;
  double mu = 0, lambda = 0;          // Pa, at small strain; orthotropic: Voigt's averages
  double c10 = 0, c01 = 0, bulk = 0;  // Pa, of Mooney and Rivlin; `bulk` of Arruda and Boyce too
  double chains = 0, links = 0;       // of Arruda and Boyce: their mu (n k T) [Pa], lambda_m^2
  double moduli[6][6] = {};           // Pa, orthotropic: of xx, yy, zz, xy, yz, zx, shears as angles
  double stiffest = 0;                // Pa, largest eigenvalue of dP/dF at rest; not of neo-Hooke
};

}  // namespace flexel::simulate
