// Elements at the voxels' centres whose connections lie in one plane or on one line: springs resist nothing
// across it.
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/state/state.h"

namespace flexel::simulate {

// (elements) 1: of a centre-placed part, and without connections in three independent directions, or only
// with such elements. Those of a part count only where they are at most a thousandth of its elements: the
// tips and edges of a sound part, to be carried along. More of them are a wall of one element.
[[nodiscard]] std::vector<std::uint8_t> unsupported_elements(const Problem& problem);

}  // namespace flexel::simulate
