// Equilibrium of a body with rigid links (simulate/conditions/rigid_link.h).
#pragma once
#include <optional>

#include "simulate/equilibrium/newton.h"

namespace flexel::simulate {

// As newton(), with every rigid link where its force and its couple are in balance with what it pulls.
// Without links it is newton(). On failure the links are where they were. Throws InputError, named for the
// link, when nothing resists a motion of it.
// `memory`: of newton(); where there are links it is left as it is.
[[nodiscard]] NewtonOutcome newton_with_links(Mechanics& mechanics, State& state,
                                              const NewtonOptions& options, const NewtonProgress& progress,
                                              NewtonMemory* memory = nullptr);

// Whether motions of the rigid links, the elements following, raise the energy at an equilibrium, whose positive tangent
// Mechanics::tangent() holds, eliminated (simulate/conditions/link_stability.h). True without links. Nothing: a torque that
// keeps its direction has no energy, and what is known does not tell; the run is to stop, under a StopWaits too; or a load
// that follows acts beside links, which the tangent does not have.
[[nodiscard]] std::optional<bool> links_are_stable(Mechanics& mechanics, State state,
                                                   const Preconditioner& preconditioner);

}  // namespace flexel::simulate
