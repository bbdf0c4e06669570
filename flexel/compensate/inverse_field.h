// The displacement that undoes another.
#pragma once
#include "formats/lattice/body.h"

namespace flexel::commands {

// `made` is deformed by u from its rest positions; every element of `wanted`, which rests about where the matter of `made` has gone, gets the
// position y with y + u(y) = its own rest position. Columns of earlier runs are dropped. u reaches beyond the matter of `made` as its
// nearest cell has it, trilinear.
void take_inverse_field(const Body& made, Body& wanted);

}  // namespace flexel::commands
