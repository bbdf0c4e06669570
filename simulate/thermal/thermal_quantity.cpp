// A list of units a dimension: temperatures have a zero of their own, which base/units.h does not know.
#include "simulate/thermal/thermal_quantity.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "base/error.h"

namespace flexel::simulate {
namespace {

struct ThermalUnit {
  const char* name;
  double factor, zero = 0;
};

struct ThermalUnits {
  const char* what;
  std::vector<ThermalUnit> units;
};

const ThermalUnits& units_of(ThermalDimension dimension) {
  static const std::vector<ThermalUnits> all = {
      {"a temperature",
       {{"degC", 1, 273.15},
        {"K", 1},
        {"degF", 5. / 9, 459.67 * 5 / 9},
        {"C", 1, 273.15},
        {"F", 5. / 9, 459.67 * 5 / 9}}},
      {"a difference of temperatures", {{"K", 1}, {"degC", 1}, {"degF", 5. / 9}}},
      {"a temperature gradient", {{"K/m", 1}, {"K/mm", 1e3}, {"K/cm", 1e2}}},
      {"a coefficient of expansion",
       {{"/K", 1}, {"1/K", 1}, {"um/(m K)", 1e-6}, {"um/m/K", 1e-6}, {"ppm/K", 1e-6}}},
      {"a conductivity", {{"W/(m K)", 1}, {"W/m/K", 1}, {"W/mK", 1}, {"mW/(mm K)", 1}}},
      {"a heat flux",
       {{"W/m2", 1}, {"W/m^2", 1}, {"kW/m2", 1e3}, {"kW/m^2", 1e3}, {"W/mm2", 1e6}, {"W/cm2", 1e4}}},
      {"a heat flow", {{"W", 1}, {"mW", 1e-3}, {"kW", 1e3}}},
      {"a coefficient of convection", {{"W/(m2 K)", 1}, {"W/(m^2 K)", 1}, {"W/m2/K", 1}, {"W/m2K", 1}}}};
  return all[static_cast<std::size_t>(dimension)];
}

double to_thermal(const SceneValue& value, ThermalDimension dimension, const std::string& key,
                  const TableReader& reader) {
  const std::string where = reader.place(value.line);
  if (value.kind == SceneValue::Kind::string) return parse_thermal(value.text, dimension, where);
  const bool zero = dimension != ThermalDimension::temperature && value.kind == SceneValue::Kind::number &&
                    value.number == 0;
  if (zero) return 0;
  const ThermalUnits& known = units_of(dimension);
  throw InputError(where, fmt::format("\"{}\" needs {} with its unit, for example \"20 {}\"", key, known.what,
                                      known.units.front().name));
}

}  // namespace

double parse_thermal(const std::string& text, ThermalDimension dimension, const std::string& where) {
  const ThermalUnits& known = units_of(dimension);
  const auto fail = [&](const std::string& why) -> double {
    std::string names;
    for (const ThermalUnit& unit : known.units) names += (names.empty() ? "" : ", ") + std::string(unit.name);
    throw InputError(where, fmt::format("\"{}\" is not {}: {}; units: {}", text, known.what, why, names));
  };
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) return fail("a number comes first");
  std::string name(end);
  name.erase(0, name.find_first_not_of(' ') == std::string::npos ? name.size() : name.find_first_not_of(' '));
  name.erase(name.find_last_not_of(' ') + 1);
  for (const ThermalUnit& unit : known.units) {
    if (name != unit.name) continue;
    const double value = number * unit.factor + unit.zero;
    if (!std::isfinite(value)) return fail("it is not finite");
    if (dimension == ThermalDimension::temperature && value < 0) return fail("it is below absolute zero");
    return value;
  }
  return fail(name.empty() ? "a unit is missing" : fmt::format("unknown unit \"{}\"", name));
}

std::optional<double> thermal_quantity(TableReader& reader, const std::string& key,
                                       ThermalDimension dimension) {
  const SceneValue* value = reader.find(key);
  if (value == nullptr) return std::nullopt;
  return to_thermal(*value, dimension, key, reader);
}

std::optional<Vec3> thermal_vector(TableReader& reader, const std::string& key, ThermalDimension dimension) {
  const SceneValue* value = reader.find(key);
  if (value == nullptr) return std::nullopt;
  if (value->kind != SceneValue::Kind::array || value->items.size() != 3)
    reader.fail(value->line, fmt::format("\"{}\" needs three components", key));
  Vec3 result;
  for (int axis = 0; axis < 3; ++axis)
    result[axis] = to_thermal(value->items[static_cast<std::size_t>(axis)], dimension, key, reader);
  return result;
}

}  // namespace flexel::simulate
