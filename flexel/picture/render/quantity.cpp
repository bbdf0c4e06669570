// Units by tables; ticks by steps of 1, 2, 5.
#include "flexel/picture/render/quantity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

namespace flexel::picture {
namespace {

struct Named {
  std::string_view name;
  Dimension dimension;
};
// The attributes that the programs make, in SI units (docs/reference/body-file.md). An attribute of a file's own has no
// unit that we know.
constexpr std::array<Named, 11> kNamed{{{"displacement", Dimension::length},
                                        {"thickness", Dimension::length},
                                        {"velocity", Dimension::velocity},
                                        {"von_mises", Dimension::pressure},
                                        {"cell_von_mises", Dimension::pressure},
                                        {"principal_stress", Dimension::pressure},
                                        {"cell_principal_stress", Dimension::pressure},
                                        {"strain", Dimension::share},
                                        {"plastic_strain", Dimension::share},
                                        {"spring_strain", Dimension::share},
                                        {"fill", Dimension::share}}};

struct Scale {
  double factor;
  const char* name;
};
constexpr std::array<Scale, 5> kLength{{{1e-9, "nm"}, {1e-6, "µm"}, {1e-3, "mm"}, {1, "m"}, {1e3, "km"}}};
constexpr std::array<Scale, 4> kPressure{{{1, "Pa"}, {1e3, "kPa"}, {1e6, "MPa"}, {1e9, "GPa"}}};
constexpr std::array<Scale, 3> kVelocity{{{1e-6, "µm/s"}, {1e-3, "mm/s"}, {1, "m/s"}}};
constexpr std::array<Scale, 3> kForce{{{1e-3, "mN"}, {1, "N"}, {1e3, "kN"}}};
constexpr std::array<Scale, 4> kEnergy{{{1e-6, "µJ"}, {1e-3, "mJ"}, {1, "J"}, {1e3, "kJ"}}};
constexpr std::array<Scale, 3> kMass{{{1e-6, "mg"}, {1e-3, "g"}, {1, "kg"}}};
constexpr std::array<Scale, 1> kDensity{{{1, "kg/m³"}}};
constexpr std::array<Scale, 1> kShare{{{1e-2, "%"}}};

std::span<const Scale> scales(Dimension dimension) {
  switch (dimension) {
    case Dimension::length:
      return kLength;
    case Dimension::pressure:
      return kPressure;
    case Dimension::velocity:
      return kVelocity;
    case Dimension::force:
      return kForce;
    case Dimension::energy:
      return kEnergy;
    case Dimension::mass:
      return kMass;
    case Dimension::density:
      return kDensity;
    case Dimension::share:
      return kShare;
    default:
      return {};
  }
}

}  // namespace

std::optional<Dimension> dimension_of(const std::string& attribute) {
  const std::string_view name(attribute);
  const std::string_view whole = name.substr(0, name.find_last_of('.'));  // without a component: "velocity.z"
  for (const Named& known : kNamed)
    if (known.name == name || known.name == whole) return known.dimension;
  return std::nullopt;
}

DisplayUnit display_unit(std::optional<Dimension> dimension, double largest) {
  const std::span<const Scale> table = dimension ? scales(*dimension) : std::span<const Scale>();
  if (!table.empty()) {
    const Scale* chosen = &table.front();
    for (const Scale& scale : table)
      if (std::abs(largest) >= 0.9995 * scale.factor) chosen = &scale;
    return {chosen->factor, chosen->name};
  }
  if (!(std::abs(largest) > 0) || (std::abs(largest) >= 1e-2 && std::abs(largest) < 1e5)) return {1, ""};
  // An unknown unit: powers of a thousand.
  const int power = 3 * static_cast<int>(std::floor(std::log10(std::abs(largest)) / 3));
  return {std::pow(10.0, power), fmt::format("1e{}", power)};
}

double round_below(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {10.0, 5.0, 2.0})
    if (step * power <= value * (1 + 1e-9)) return step * power;
  return power;
}

Ticks round_ticks(double low, double high, int most) {
  Ticks ticks;
  const double largest = std::max(std::abs(low), std::abs(high));
  if (!(high - low > 1e-12 * largest) || !std::isfinite(high - low)) return ticks;
  const double spare = 1e-6 * (high - low);
  // The smallest round step that leaves few enough.
  double step = round_below((high - low) / (most + 1));
  const auto count = [&] { return std::floor((high + spare) / step) - std::ceil((low - spare) / step) + 1; };
  while (count() > most) step = round_below(step * 2.5);
  const int decimals = std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 17);
  const double first = std::ceil((low - spare) / step);
  for (double k = first; k * step <= high + spare; ++k) {
    const double value = k == 0 ? 0 : k * step;
    ticks.values.push_back(value);
    ticks.labels.push_back(fmt::format("{:.{}f}", value, decimals));
  }
  return ticks;
}

std::string short_number(double value) {
  return fmt::format("{:.3g}", value);
}

}  // namespace flexel::picture
