// Warns of parts of an unusual size, whose file likely has another unit.
#pragma once
#include <string>
#include <vector>

#include "formats/part/surface.h"

namespace flexel {

constexpr double kSuspiciouslySmall = 1e-4, kSuspiciouslyLarge = 100;  // m, largest extent
constexpr double kSmallWithoutUnit = 5e-3;  // m, where neither the file nor the user gave a unit

// A line for every file whose largest part is smaller or larger than that; it names the unit in which the
// part would be nearest to the size of a hand, or those that are common, and what to do.
[[nodiscard]] std::vector<std::string> size_warnings(const Surface& surface);

}  // namespace flexel
