// Formats a vector for reports.
#pragma once
#include <array>

#include "base/math/vec.h"

namespace flexel::commands {

// x, y, z: what JSON writes as a list.
[[nodiscard]] inline std::array<double, 3> coordinates(const Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

}  // namespace flexel::commands
