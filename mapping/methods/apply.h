// Where bound vertices go.
#pragma once
#include <cstdint>
#include <vector>

#include "mapping/methods/bind.h"

namespace flexel::mapping {

// Maps the state `position` (elements x 3, m) onto the vertices: (vertices x 3) m.
[[nodiscard]] std::vector<Vec3> apply(const Binding& binding, const Body& body,
                                      const std::vector<Vec3>& position);

// (vertices) bits of MapFlag: what became of the quadruple that holds each vertex, and of the vertex. 0 for
// vertices that no polygon uses, unless they are not finite.
[[nodiscard]] std::vector<std::uint8_t> judge(const Binding& binding, const Body& body,
                                              const std::vector<Vec3>& position,
                                              const std::vector<Vec3>& displacement);

}  // namespace flexel::mapping
