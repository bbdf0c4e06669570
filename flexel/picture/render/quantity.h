// The quantity of an attribute and how it is formatted: suitable units, round numbers.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "base/units.h"

namespace flexel::picture {

// Of the attributes that the programs make: "von_mises" is a pressure, "strain" a share; nothing for any other.
[[nodiscard]] std::optional<Dimension> dimension_of(const std::string& attribute);

// A unit that gives values up to `largest` (SI) handy numbers.
struct DisplayUnit {
  double factor = 1;  // SI per unit
  std::string name;   // "" for plain numbers
};
[[nodiscard]] DisplayUnit display_unit(std::optional<Dimension> dimension, double largest);

// The numbers 1, 2 or 5 times a power of ten apart that lie in [low, high] (with a millionth to spare), at
// most `most` of them, at least two where that is possible. Empty unless low < high are finite and differ by
// more than rounding.
struct Ticks {
  std::vector<double> values;
  std::vector<std::string> labels;  // with as many decimals as the step needs
};
[[nodiscard]] Ticks round_ticks(double low, double high, int most);

// The largest of 1, 2, 5 times a power of ten that is not above `value` (> 0).
[[nodiscard]] double round_below(double value);

// Three significant digits: "5.26", "0.00012", "1.2e+09".
[[nodiscard]] std::string short_number(double value);

}  // namespace flexel::picture
