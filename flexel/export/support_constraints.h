// Fixes and moves as held nodes and equations.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "flexel/export/analysis.h"

namespace flexel::mesh_export {

// Components that are already held: (node, axis) -> value [m]; not a number where an equation gives it.
using HeldValues = std::map<std::pair<std::uint32_t, std::uint8_t>, double>;

// A fix or a move as held nodes, and equations where the surface cuts through hexahedra. Degrees of freedom
// that are held already stay so; `shared` counts those that this support wanted elsewhere. Throws InputError:
// no node lies under the selected surface.
[[nodiscard]] AnalysisSupport hold(const simulate::Tie& tie, const AnalysisMesh& mesh,
                                   const simulate::Problem& problem, HeldValues& taken, std::size_t& shared);

}  // namespace flexel::mesh_export
