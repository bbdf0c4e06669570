// Products of columns of vectors, one vector a row of a system.
#pragma once
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

// sum_i a_i . b_i, in parallel; the same bits for any thread count.
[[nodiscard]] double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

}  // namespace flexel::simulate
