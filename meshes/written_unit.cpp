// Looks for one element (XML) or one header variable (DXF); a parser for all of the text would take as long as assimp.
#include "meshes/written_unit.h"

#include <charconv>
#include <cmath>
#include <utility>

namespace flexel::meshes {
namespace {

constexpr double kMillimetre = 1e-3, kInch = 0.0254, kFoot = 0.3048;

// 0 where it is none.
double positive(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '+')) text.remove_prefix(1);
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return std::isfinite(value) && value > 0 ? value : 0;
}

// The start tag `<name ...>` from `from` on; "" where there is none.
std::string_view tag(std::string_view text, std::string_view name, std::size_t from = 0) {
  for (std::size_t at = text.find(name, from); at != std::string_view::npos; at = text.find(name, at + 1)) {
    const std::size_t after = at + name.size();
    const bool whole =
        after >= text.size() || std::string_view(" \t\r\n/>").find(text[after]) != std::string_view::npos;
    if (at > 0 && text[at - 1] == '<' && whole) return text.substr(at, text.find('>', at) - at);
  }
  return {};
}

// The value of an attribute of a tag; "" where it has none.
std::string_view attribute(std::string_view tag, std::string_view name) {
  for (std::size_t at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
    std::size_t value = at + name.size();
    const bool whole = at > 0 && std::string_view(" \t\r\n").find(tag[at - 1]) != std::string_view::npos;
    while (value < tag.size() && (tag[value] == ' ' || tag[value] == '=')) ++value;
    if (!whole || value >= tag.size() || (tag[value] != '"' && tag[value] != '\'')) continue;
    const std::size_t end = tag.find(tag[value], value + 1);
    return tag.substr(value + 1, end == std::string_view::npos ? end : end - value - 1);
  }
  return {};
}

// COLLADA 1.5, <asset><unit meter="0.01"/>; 1 where it is left out.
double collada_unit(std::string_view text) {
  const double metres = positive(attribute(tag(text, "unit"), "meter"));
  return metres > 0 ? metres : 1;
}

// ISO/ASTM 52915; "feet" and "microns" are what programs write too.
double amf_unit(std::string_view text) {
  constexpr std::pair<std::string_view, double> kUnits[] = {{"millimeter", kMillimetre},
                                                            {"inch", kInch},
                                                            {"feet", kFoot},
                                                            {"foot", kFoot},
                                                            {"meter", 1},
                                                            {"micron", 1e-6},
                                                            {"micrometer", 1e-6}};
  const std::string_view unit = attribute(tag(text, "amf"), "unit");
  for (const auto& [name, metres] : kUnits)
    if (unit == name) return metres;
  return kMillimetre;
}

// ISO/IEC 19775-1: metres, or <unit category="length" conversionFactor="0.001"/>.
double x3d_unit(std::string_view text) {
  for (std::size_t at = text.find("<unit"); at != std::string_view::npos; at = text.find("<unit", at + 1)) {
    const std::string_view unit = tag(text, "unit", at);
    if (attribute(unit, "category") != "length") continue;
    const double factor = positive(attribute(unit, "conversionFactor"));
    return factor > 0 ? factor : 1;
  }
  return 1;
}

// The line after the next: a group code, and its value.
std::string_view value_after(std::string_view text, std::size_t at) {
  for (int line = 0; line < 2; ++line) {
    at = text.find('\n', at);
    if (at == std::string_view::npos) return {};
    ++at;
  }
  return text.substr(at, text.find('\n', at) - at);
}

// $INSUNITS of the header (AutoCAD's DXF reference); 0 and the rarer ones: not said.
double dxf_unit(std::string_view text) {
  const std::size_t at = text.find("$INSUNITS");
  if (at == std::string_view::npos) return 0;
  constexpr std::pair<int, double> kUnits[] = {
      {1, kInch},        {2, kFoot},        {4, kMillimetre}, {5, 1e-2},  {6, 1},
      {8, 1e-6 * kInch}, {9, 1e-3 * kInch}, {10, 3 * kFoot},  {13, 1e-6}, {14, 0.1}};
  const double number = positive(value_after(text, at));
  for (const auto& [code, metres] : kUnits)
    if (number == code) return metres;
  return 0;
}

}  // namespace

double written_unit(std::string_view format, std::string_view text) {
  if (format == "dae") return collada_unit(text);
  if (format == "amf") return amf_unit(text);
  if (format == "x3d") return x3d_unit(text);
  if (format == "dxf") return dxf_unit(text);
  // LightWave's and Blender's own unit is the metre.
  return format == "lwo" || format == "blend" ? 1 : 0;
}

}  // namespace flexel::meshes
