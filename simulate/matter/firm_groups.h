// Which cells hold together firmly, and which hang on others by a corner or along an edge only: about that
// they turn without resistance.
#pragma once
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::simulate {

constexpr std::uint32_t kNoGroup = 0xffffffffu;

// (cells) number of the cell's group, in order of their first cell; kNoGroup where it is broken. Two groups
// share no element, or hang together as a hinge does: with every other group held as well, one of them could
// still move as a rigid body.
[[nodiscard]] std::vector<std::uint32_t> firm_groups(const Body& body);

}  // namespace flexel::simulate
