// What a scene says of heat and of shrinkage, as it was read; and the figures of materials for it.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "simulate/input/materials.h"
#include "simulate/input/selection.h"

namespace flexel::simulate {

struct ThermalFigures {
  std::optional<double> expansion, conductivity;  // 1/K, W/(m K)
  std::string source;
};

// [thermal]: a change of temperature that matter expands by.
struct TemperatureChange {
  double change = 0;                // K
  Vec3 gradient = Vec3::Zero();     // K/m, world frame
  Vec3 about = Vec3::Zero();        // m, where the gradient gives nothing
  std::string column;               // temperatures [K] of the body's elements or cells; "": none
  std::optional<double> reference;  // K, at which the part has its shape; of a column, and of conduction
  std::optional<std::string> part;  // nothing: every part
  std::string origin;
};

// [shrinkage]: the inherent strain of a print's layers.
struct Shrinkage {
  Vec3 axis = Vec3::UnitZ();           // unit, that layers are stacked along
  double layer = 0;                    // m
  double along = 0, across = 0;        // strain along the axis and across it
  std::vector<double> height, factor;  // m above the part's lowest point; of both strains; none: 1
  std::optional<std::string> part;
  std::string origin;
};

// Faces of steady conduction.
struct HeatFace {
  enum class Kind { temperature, flux, power, convection };
  Kind kind = Kind::temperature;
  double value = 0;    // K; W/m^2; W; W/(m^2 K)
  double ambient = 0;  // K, of convection
  Selection where;
  std::string name, origin;
};

struct ThermalSettings {
  std::vector<TemperatureChange> changes;  // which goes before which: entries_of_parts()
  std::vector<Shrinkage> shrinkages;       // likewise
  std::vector<HeatFace> faces;
  std::map<std::string, ThermalFigures> materials;  // the scene's own, with or without figures

  [[nodiscard]] bool expands() const { return !changes.empty() || !shrinkages.empty(); }
  [[nodiscard]] bool conducts() const { return !faces.empty(); }
};

// Elements' column [K] that conduction writes.
constexpr const char* kTemperatureColumn = "temperature";
// Whether a column of the body is one that the scene takes temperatures from.
[[nodiscard]] bool is_temperature_column(const ThermalSettings& settings, const std::string& column);

// Of the library, at room temperature; nothing in what is not known.
[[nodiscard]] ThermalFigures library_thermal_figures(const std::string& material);
// The scene's own go before the library; the conductivity is what an infill leaves of it.
[[nodiscard]] ThermalFigures thermal_figures(const ThermalSettings& settings, const Material& material);

}  // namespace flexel::simulate
