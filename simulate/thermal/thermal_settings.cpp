// The library's figures of heat. "not read": named from general knowledge, nobody has looked it up there.
#include "simulate/thermal/thermal_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "simulate/input/material_names.h"

namespace flexel::simulate {
namespace {

struct LibraryFigures {
  const char* name;
  double expansion, conductivity;  // 0: left out
  const char* source;
};

constexpr LibraryFigures kFigures[] = {
    {"steel", 12e-6, 53.3, "not read: EN 1993-1-1, 3.2.6, EN 1993-1-2, 3.4.1.3"},
    {"steel S355", 12e-6, 53.3, "as steel"},
    {"stainless", 16e-6, 15, "not read: EN 10088-1 (20 to 100 degC)"},
    {"stainless 316", 16e-6, 15, "not read: EN 10088-1 (20 to 100 degC)"},
    {"ductile iron", 12.5e-6, 36.2, "not read: EN 1563, annex (to 400 degC)"},
    {"aluminium 6061", 23.6e-6, 167, "not read: Aluminum Association, typical"},
    {"aluminium 6082", 23e-6, 170, "not read: EN 1999-1-1, 3.2.5; conductivity least of 170 to 180"},
    {"aluminium 5083", 23.8e-6, 117, "not read: Aluminum Association, typical"},
    {"aluminium 2024", 23.2e-6, 121, "not read: Aluminum Association, typical"},
    {"aluminium 7075", 23.6e-6, 130, "not read: Aluminum Association, typical"},
    {"titanium", 8.6e-6, 6.7, "not read: ASM, typical (20 to 100 degC)"},
    {"magnesium", 26e-6, 96, "not read: ASM, typical"},
    {"nickel alloy 718", 13e-6, 11.4, "not read: Special Metals SMC-045 (to 93 degC)"},
    {"brass", 20.5e-6, 115, "not read: Copper Development Association"},
    {"copper", 17e-6, 388, "not read: Copper Development Association"},
    {"bronze", 17.8e-6, 69, "not read: Copper Development Association"},
    {"tungsten", 4.5e-6, 173, "not read: CRC Handbook"},
    {"polycarbonate", 65e-6, 0.20, "not read: Covestro's data sheet (ISO 11359)"},
    {"PMMA", 70e-6, 0.19, "not read: data sheets of cast sheet"},
    {"concrete", 10e-6, 0, "not read: EN 1992-1-1, 3.1.3"},
    {"glass", 9e-6, 1.0, "not read: EN 572-1"},
    {"borosilicate glass", 3.3e-6, 1.2, "not read: ISO 3585"},
};

}  // namespace

ThermalFigures library_thermal_figures(const std::string& material) {
  const Material* known = library_material(material);
  for (const LibraryFigures& each : kFigures) {
    if (known == nullptr || known->name != each.name) continue;
    ThermalFigures figures;
    if (each.expansion > 0) figures.expansion = each.expansion;
    if (each.conductivity > 0) figures.conductivity = each.conductivity;
    figures.source = each.source;
    return figures;
  }
  return {};
}

ThermalFigures thermal_figures(const ThermalSettings& settings, const Material& material) {
  ThermalFigures found = library_thermal_figures(material.name);
  for (const auto& [name, figures] : settings.materials)
    if (same_material_name(name, material.name)) {
      found = figures;
      break;
    }
  // Of struts that run all ways, without the air between them (Ashby, Phil. Trans. R. Soc. A 364, 2006); free strain does
  // not depend on how dense the matter is.
  if (const double f = material.infill; found.conductivity && f < 1)
    *found.conductivity *= material.walls + (1 - material.walls) * (f + 2 * f * std::sqrt(f)) / 3;
  return found;
}

bool is_temperature_column(const ThermalSettings& settings, const std::string& column) {
  if (column == kTemperatureColumn && settings.conducts()) return true;
  return std::any_of(settings.changes.begin(), settings.changes.end(),
                     [&](const TemperatureChange& each) { return each.column == column; });
}

}  // namespace flexel::simulate
