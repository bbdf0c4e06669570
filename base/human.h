// Figures as people write them: no exponents, a unit that fits, no more digits than are known.
// base/units.h has lengths, forces and the like without a bar.
#pragma once
#include <cstddef>
#include <string>

namespace flexel {

// `digits` significant digits, never an exponent, trailing zeros left out: 637500 is "637,500",
// 4000 "4000".
[[nodiscard]] std::string human_number(double value, int digits = 3);

// Two significant digits: 0.0234 is "2.3 %", 2.37 "240 %"; from ten on "24 times"; below a hundredth of a
// percent "under 0.01 %".
[[nodiscard]] std::string human_share(double share);

// "0.25 s", "40 s", "12 min", "2.5 h"; two significant digits.
[[nodiscard]] std::string human_seconds(double seconds);

[[nodiscard]] std::string human_energy(double joules);  // "261 mJ"

// "1 voxel", "2,048 voxels".
[[nodiscard]] std::string counted(std::size_t count, const std::string& noun);

// "54.1 um +- 1.6 um": the bar [m] has two significant digits, the length as many decimals as its bar, four
// significant digits at most. A bar below the last of them is "under" one of it.
[[nodiscard]] std::string length_with_bar(double metres, double bar);
[[nodiscard]] std::string pressure_with_bar(double pascals, double bar);
[[nodiscard]] std::string energy_with_bar(double joules, double bar);

// "0 to 5.7 mm", of a quantity [m] that is known that badly.
[[nodiscard]] std::string length_range(double low, double high);

}  // namespace flexel
