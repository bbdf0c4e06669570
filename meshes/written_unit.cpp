// Looks for one element: a parser for all of the text would take as long as assimp.
#include "meshes/written_unit.h"

#include <charconv>
#include <cmath>

#include "base/error.h"

namespace flexel::meshes {
namespace {

// The first start tag `<name ...>` outside comments; "" where there is none.
std::string_view tag(std::string_view text, std::string_view name) {
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
    if (text.substr(at).starts_with("<!--")) {
      at = text.find("-->", at);
      if (at == std::string_view::npos) return {};
      continue;
    }
    const std::size_t after = at + 1 + name.size();
    if (text.substr(at + 1, name.size()) == name && after < text.size() &&
        std::string_view(" \t\r\n/>").find(text[after]) != std::string_view::npos)
      return text.substr(at, text.find('>', at) - at);
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
double collada_unit(std::string_view text, const std::string& where) {
  const std::string_view metres = attribute(tag(text, "unit"), "meter");
  if (metres.empty()) return 1;
  double value = 0;
  std::from_chars(metres.data(), metres.data() + metres.size(), value);
  if (!std::isfinite(value) || value <= 0)
    throw InputError(where, "its unit of length is not a positive number of metres");
  return value;
}

}  // namespace

double written_unit(std::string_view format, std::string_view text, const std::string& where) {
  if (format == "dae") return collada_unit(text, where);
  // LightWave's and Blender's own unit is the metre.
  return format == "lwo" || format == "blend" ? 1 : 0;
}

}  // namespace flexel::meshes
