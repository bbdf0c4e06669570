// CGAL's word on whether triangles bound a solid: an oracle for pieces.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/math/vec.h"

namespace flexel::mapping::test {

// "" for triangles that, with points at one position joined as readers of STL do, are a closed manifold whose
// shells bound a volume and do not cross; else what is wrong.
std::string what_cgal_minds(const std::vector<Vec3>& points,
                            const std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace flexel::mapping::test
