// Physical quantities as people write them ("2 mm", "5 N", "210 GPa"), in SI inside.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace flexel {

enum class Dimension {
  length,
  area,
  volume,
  mass,
  time,
  angle,
  force,
  torque,
  pressure,
  density,
  velocity,
  acceleration,
  energy,
  share,
  gravitational_constant,
  temperature,  // absolute
  temperature_difference,
  temperature_gradient,
  expansion,
  power,
  heat_flux,
  conductivity,
  heat_transfer
};

// The value of `text` in the SI unit of `dimension` (radians for angles; "30 %" is 0.3 for shares). A number
// is required before a unit. Throws InputError: not a number, no unit where one is needed (a share needs
// none), an unknown unit (with the nearest), a unit of another dimension, not finite, a temperature below
// absolute zero. `0` alone is accepted for every dimension but temperature, whose zero is the unit's.
[[nodiscard]] double parse_quantity(std::string_view text, Dimension dimension);

// Metres per unit of a length unit's name: "mm", "cm", "m", "in", "inch", "ft", "um", "millimetre" ... Throws
// InputError.
[[nodiscard]] double length_unit(std::string_view name);

// The units a dimension accepts, for messages and documentation.
[[nodiscard]] std::vector<std::string> unit_names(Dimension dimension);
[[nodiscard]] const char* dimension_name(Dimension dimension);
[[nodiscard]] const char* dimension_example(Dimension dimension);  // "2 mm"

// A quantity for people: 3 to 4 significant digits and a fitting SI prefix ("1.84 mm", "210 GPa", "34.2 MB"
// for bytes).
[[nodiscard]] std::string human_length(double metres);
[[nodiscard]] std::string human_volume(double cubic_metres);
[[nodiscard]] std::string human_bytes(double bytes);
[[nodiscard]] std::string human_count(std::size_t count);  // 51,234
[[nodiscard]] std::string human_force(double newtons);
[[nodiscard]] std::string human_pressure(double pascals);

}  // namespace flexel
