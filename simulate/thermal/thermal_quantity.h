// Quantities of heat as scenes write them: "20 degC", "80 K", "500 K/m", "12e-6 /K", "50 W/(m K)".
#pragma once
#include "simulate/input/scene_table.h"

namespace flexel::simulate {

// temperature: K (absolute); difference: K; gradient: K/m; expansion: 1/K; conductivity: W/(m K); flux: W/m^2; power: W;
// film: W/(m^2 K), of convection.
enum class ThermalDimension { temperature, difference, gradient, expansion, conductivity, flux, power, film };

// In SI units. Throws InputError: no number, none or another unit (with those that are known), not finite, a temperature
// below absolute zero.
[[nodiscard]] double parse_thermal(const std::string& text, ThermalDimension dimension,
                                   const std::string& where);

// Of a key of a table; nothing where it is absent.
[[nodiscard]] std::optional<double> thermal_quantity(TableReader& reader, const std::string& key,
                                                     ThermalDimension dimension);
[[nodiscard]] std::optional<Vec3> thermal_vector(TableReader& reader, const std::string& key,
                                                 ThermalDimension dimension);

}  // namespace flexel::simulate
