// Quantities for people: three significant digits in a fitting unit.
#include "base/human.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/units.h"

namespace flexel {
namespace {

// 10^magnitude is the first digit's place once the value is rounded to `digits`.
int magnitude_of(double value, int digits) {
  const double size = std::abs(value);
  int magnitude = static_cast<int>(std::floor(std::log10(size)));
  if (std::round(size / std::pow(10, magnitude - digits + 1)) >= std::pow(10, digits)) ++magnitude;
  return magnitude;
}

void strip_zeros(std::string& text) {
  if (text.find('.') == std::string::npos) return;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
}

// 3 significant digits without a trailing ".0", never in the form 1e3.
std::string significant(double value, int digits = 3) {
  if (value == 0 || !std::isfinite(value)) return fmt::format("{}", value);
  std::string text = fmt::format("{:.{}f}", value, std::max(0, digits - 1 - magnitude_of(value, digits)));
  strip_zeros(text);
  return text;
}

struct Scale {
  double factor;
  const char* name;
};

constexpr Scale kLengths[] = {{1e-9, "nm"}, {1e-6, "um"}, {1e-3, "mm"}, {1, "m"}, {1e3, "km"}};
constexpr Scale kPressures[] = {{1, "Pa"}, {1e3, "kPa"}, {1e6, "MPa"}, {1e9, "GPa"}};

// The largest unit in which the value, rounded to three digits, is at least 1.
const Scale& fitting(double value, std::span<const Scale> ascending) {
  const Scale* chosen = &ascending.front();
  for (const Scale& scale : ascending)
    if (std::abs(value) >= 0.9995 * scale.factor) chosen = &scale;
  return *chosen;
}

std::string human(double value, std::span<const Scale> ascending) {
  const Scale& unit = fitting(value, ascending);
  return fmt::format("{} {}", significant(value / unit.factor), unit.name);
}

std::string with_bar(double value, double bar, std::span<const Scale> ascending) {
  constexpr int kMostDigits = 4;
  if (value == 0 || !std::isfinite(value) || !std::isfinite(bar)) return human(value, ascending);
  const Scale& unit = fitting(value, ascending);
  const double shown = value / unit.factor, width = std::abs(bar) / unit.factor;
  const int finest = kMostDigits - 1 - magnitude_of(shown, kMostDigits);
  const int wanted = width > 0 ? 1 - magnitude_of(width, 2) : finest + 1;
  const int decimals = std::clamp(wanted, 0, std::max(finest, 0));
  const double last = std::pow(10, -decimals);
  // What is cut to fewer digits is not made narrower by that
  const double rounded = wanted > decimals ? std::ceil(width / last - 1e-9) * last : width;
  const std::string bar_text = width >= last ? fmt::format("{:.{}f}", rounded, decimals)
                                             : fmt::format("under {:.{}f}", last, decimals);
  return fmt::format("{:.{}f} {} +- {} {}", shown, decimals, unit.name, bar_text, unit.name);
}

std::string with_separators(std::string digits) {
  const std::size_t begin = digits.find_first_of("0123456789");
  std::size_t at = std::min(digits.find('.'), digits.size());
  if (at - begin < 5) return digits;  // 4000, but 40,000
  while (at > begin + 3) digits.insert(at -= 3, 1, ',');
  return digits;
}

}  // namespace

std::string human_number(double value, int digits) {
  return with_separators(significant(value, digits));
}

std::string human_share(double share) {
  constexpr double kLeast = 1e-4, kMost = 10;
  if (share == 0) return "0 %";
  if (std::abs(share) < kLeast) return "under 0.01 %";
  if (std::abs(share) >= kMost) return human_number(share, 2) + " times";
  const double unit = std::pow(10, magnitude_of(share, 2) - 1);
  return significant(std::round(share / unit) * unit * 100) + " %";
}

std::string human_seconds(double seconds) {
  constexpr double kMinutes = 99.5, kHours = 5970;
  if (seconds < kMinutes) return significant(seconds, 2) + " s";
  return seconds < kHours ? significant(seconds / 60, 2) + " min" : significant(seconds / 3600, 2) + " h";
}

std::string counted(std::size_t count, const std::string& noun) {
  return human_count(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string length_with_bar(double metres, double bar) {
  return with_bar(metres, bar, kLengths);
}

std::string pressure_with_bar(double pascals, double bar) {
  return with_bar(pascals, bar, kPressures);
}

std::string length_range(double low, double high) {
  const Scale& unit = fitting(high, kLengths);
  const std::string most = significant(high / unit.factor, 2);
  const std::size_t point = most.find('.');
  const int decimals = point == std::string::npos ? 0 : static_cast<int>(most.size() - point - 1);
  std::string least = fmt::format("{:.{}f}", std::max(low, 0.0) / unit.factor, decimals);
  strip_zeros(least);
  return fmt::format("{} to {} {}", least, most, unit.name);
}

std::string human_length(double metres) {
  return metres == 0 ? "0 mm" : human(metres, kLengths);
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
  return pascals == 0 ? "0 Pa" : human(pascals, kPressures);
}

}  // namespace flexel
