// Quantities for people: three significant digits in a fitting unit.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "formats/units.h"

namespace flexel {
namespace {

// 3 significant digits without a trailing ".0", never in the form 1e3.
std::string significant(double value) {
  if (value == 0 || !std::isfinite(value)) return fmt::format("{}", value);
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value))));
  std::string text = fmt::format("{:.{}f}", value, std::max(0, 2 - magnitude));
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

struct Scale {
  double factor;
  const char* name;
};

// In the largest unit in which the value, rounded to three digits, is at least 1.
std::string human(double value, std::span<const Scale> ascending) {
  const Scale* chosen = &ascending.front();
  for (const Scale& scale : ascending)
    if (std::abs(value) >= 0.9995 * scale.factor) chosen = &scale;
  return fmt::format("{} {}", significant(value / chosen->factor), chosen->name);
}

}  // namespace

std::string human_length(double metres) {
  constexpr Scale kScales[] = {{1e-9, "nm"}, {1e-6, "um"}, {1e-3, "mm"}, {1, "m"}, {1e3, "km"}};
  return metres == 0 ? "0 mm" : human(metres, kScales);
}

std::string human_volume(double cubic_metres) {
  constexpr Scale kScales[] = {{1e-9, "mm^3"}, {1e-6, "cm^3"}, {1, "m^3"}};
  return human(cubic_metres, kScales);
}

std::string human_bytes(double bytes) {
  constexpr Scale kScales[] = {{1, "B"}, {1e3, "kB"}, {1e6, "MB"}, {1e9, "GB"}, {1e12, "TB"}};
  return human(bytes, kScales);
}

std::string human_count(std::size_t count) {
  std::string text = std::to_string(count);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, 1, ',');
  return text;
}

std::string human_force(double newtons) {
  constexpr Scale kScales[] = {{1e-6, "uN"}, {1e-3, "mN"}, {1, "N"}, {1e3, "kN"}, {1e6, "MN"}};
  return newtons == 0 ? "0 N" : human(newtons, kScales);
}

std::string human_pressure(double pascals) {
  constexpr Scale kScales[] = {{1, "Pa"}, {1e3, "kPa"}, {1e6, "MPa"}, {1e9, "GPa"}};
  return pascals == 0 ? "0 Pa" : human(pascals, kScales);
}

}  // namespace flexel
