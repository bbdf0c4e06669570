// The library of materials written out.
#include <fmt/format.h>

#include "base/files/json.h"
#include "base/units.h"
#include "flexel/measure/materials_table.h"
#include "simulate/input/hardening.h"
#include "simulate/thermal/thermal_settings.h"

namespace flexel::commands {
namespace {

std::string pressure(double value) {
  return value > 0 ? human_pressure(value) : "";
}

std::string percent(double share) {
  return share > 0 ? fmt::format("{:.3g} %", 100 * share) : "";
}

// By how much the yield stress rises with the equivalent plastic strain a.
std::string hardening(const simulate::Material& material) {
  if (const auto voce = simulate::voce_hardening(material))
    return fmt::format("{} (1 - exp(-{:.3g} a))", human_pressure(voce->saturation), voce->rate);
  return material.hardening > 0 ? human_pressure(material.hardening) + " a" : "";
}

std::string source_of(const simulate::Material& material) {
  const std::string heat = simulate::library_thermal_figures(material.name).source;
  return heat.empty() ? material.source : material.source + "; heat: " + heat;
}

std::vector<std::string> row(const simulate::Material& material) {
  const simulate::ThermalFigures heat = simulate::library_thermal_figures(material.name);
  return {material.name,
          human_pressure(material.young),
          fmt::format("{:.4g}", material.poisson),
          fmt::format("{:.0f}", material.density),
          pressure(material.yield),
          pressure(material.strength),
          percent(material.elongation),
          percent(material.uniform_elongation),
          hardening(material),
          pressure(material.layer_strength),
          material.friction > 0 ? fmt::format("{:.2g}", material.friction) : "",
          percent(material.damping),
          heat.expansion ? fmt::format("{:.3g}", 1e6 * *heat.expansion) : "",
          heat.conductivity ? fmt::format("{:.3g}", *heat.conductivity) : "",
          source_of(material)};
}

const std::vector<std::string> kHead = {"name",
                                        "young",
                                        "poisson",
                                        "density [kg/m3]",
                                        "yield",
                                        "strength",
                                        "elongation",
                                        "uniform elongation",
                                        "hardening",
                                        "across layers",
                                        "friction",
                                        "damping",
                                        "expansion [1e-6/K]",
                                        "conductivity [W/(m K)]",
                                        "source"};

}  // namespace

std::string materials_text() {
  std::vector<std::vector<std::string>> rows{kHead};
  for (const simulate::Material& material : simulate::material_library()) rows.push_back(row(material));
  std::vector<std::size_t> width(kHead.size(), 0);
  for (const auto& each : rows)
    for (std::size_t c = 0; c < width.size(); ++c) width[c] = std::max(width[c], each[c].size());
  std::string text;
  for (const auto& each : rows) {
    for (std::size_t c = 0; c + 1 < width.size(); ++c) text += fmt::format("{:<{}}  ", each[c], width[c]);
    text += each.back() + "\n";
  }
  return text;
}

std::string materials_markdown() {
  std::string text = fmt::format("| {} |\n|", fmt::join(kHead, " | "));
  for (std::size_t c = 0; c < kHead.size(); ++c) text += "---|";
  text += "\n";
  for (const simulate::Material& material : simulate::material_library())
    text += fmt::format("| {} |\n", fmt::join(row(material), " | "));
  return text;
}

std::string materials_words() {
  std::string text;
  for (const simulate::Material& material : simulate::material_library()) text += material.name + "\n";
  return text;
}

std::string materials_json() {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const simulate::Material& material : simulate::material_library()) {
    nlohmann::ordered_json each = {{"name", material.name},
                                   {"young", material.young},
                                   {"poisson", material.poisson},
                                   {"density", material.density}};
    for (const auto& [key, value] : {std::pair{"yield", material.yield},
                                     {"strength", material.strength},
                                     {"elongation", material.elongation},
                                     {"uniform_elongation", material.uniform_elongation},
                                     {"hardening", material.hardening},
                                     {"layer_strength", material.layer_strength},
                                     {"friction", material.friction},
                                     {"damping", material.damping}})
      if (value > 0) each[key] = value;
    const simulate::ThermalFigures heat = simulate::library_thermal_figures(material.name);
    if (heat.expansion) each["expansion"] = *heat.expansion;
    if (heat.conductivity) each["conductivity"] = *heat.conductivity;
    each["source"] = source_of(material);
    list.push_back(each);
  }
  return json_text(list, 2) + "\n";
}

}  // namespace flexel::commands
