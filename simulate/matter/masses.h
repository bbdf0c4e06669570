// Masses: of the elements that carry the inertia of a run, and the moments of a part's matter.
#pragma once
#include <vector>

#include "simulate/rigid/rigid_body.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// Inertia of each element [kg], broken cells included: an eighth of rho f V of each of its cells, or rho h^3
// in centre placement. Those of a rigid part are changed a little, linearly from one end to the other, so that
// their centre is that of its matter: gravity, which pulls at elements, does not turn it.
[[nodiscard]] std::vector<double> lumped_masses(const Problem& problem);

// (parts) Of rigid parts; the others' are 0. Of the volume that a part's surface encloses, where that is closed
// and as large as its cells say, and neither its density was edited nor anything carved; else of its cells, each
// filled evenly.
[[nodiscard]] std::vector<MassMoments> rigid_moments(const Problem& problem);

}  // namespace flexel::simulate
