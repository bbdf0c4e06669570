// Numbers formatted for people: no exponents, a suitable unit, only significant digits. base/units.h formats
// quantities without an error bar.
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

// "1 voxel", "2,048 voxels".
[[nodiscard]] std::string counted(std::size_t count, const std::string& noun);

// "54.1 um +- 1.6 um": the bar [m] has two significant digits, the length as many decimals as its bar and at
// most four significant digits. A bar smaller than one unit of the last digit is written "under" that unit.
[[nodiscard]] std::string length_with_bar(double metres, double bar);
[[nodiscard]] std::string pressure_with_bar(double pascals, double bar);

// "0 to 5.7 mm": a range [m], for values whose error bar is over half of them.
[[nodiscard]] std::string length_range(double low, double high);

}  // namespace flexel
