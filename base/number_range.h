// The range of numbers that are accepted as input. Squares of such numbers, and their sums over a body, stay
// finite; no real part needs more.
#pragma once
#include <cmath>

namespace flexel {

constexpr double kLargestNumber = 1e35;  // in SI units

// A quantity: 0, or from 1e-35 to 1e35 in size. False for NaN too.
inline bool is_readable_quantity(double value) {
  return value == 0 || (std::abs(value) >= 1 / kLargestNumber && std::abs(value) <= kLargestNumber);
}

// A bare number, which may be what rounding left over of 0: at most 1e35 in size. False for NaN too.
inline bool is_readable_number(double value) {
  return std::abs(value) <= kLargestNumber;
}

}  // namespace flexel
