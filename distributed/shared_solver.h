// The cells of a body that no rank has whole: each rank's part of a run gives and takes values of its own piece, and all solve together.
#pragma once
#include <memory>

#include "distributed/shared_body.h"
#include "simulate/equilibrium/equilibrium.h"

namespace flexel::distributed {

// Moves the cells of `mechanics`, which is of the piece, there. What it refers to must outlive what is returned. By all ranks together,
// as what is returned. Throws InputError for effects that ranks do not share.
[[nodiscard]] simulate::LoadStepSolver make_shared_solver(simulate::Mechanics& mechanics, SharedBody& body,
                                                          const simulate::Scene& scene);

}  // namespace flexel::distributed
