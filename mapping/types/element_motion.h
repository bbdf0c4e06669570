// The motion of the matter around one element.
#pragma once
#include <cstdint>

#include "base/math/vec.h"

namespace flexel::mapping {

// The displacement around an element: u(x) = displacement + gradient (x - rest position of the element).
struct ElementMotion {
  Vec3 displacement = Vec3::Zero();  // m
  Mat3 gradient = Mat3::Zero();      // F - I
};

// No place in a list of elements.
constexpr std::uint32_t kNoSlot = 0xffffffffu;

}  // namespace flexel::mapping
