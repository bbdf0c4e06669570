// STEP's entities of PMI: ISO 10303-242, "dimension_tolerance" and "annotation".
#include "cad/deform/losses.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace flexel::cad {
namespace {

bool is_pmi(std::string_view entity) {
  constexpr std::string_view kWhole[] = {"DIMENSIONAL_SIZE",
                                         "DIMENSIONAL_LOCATION",
                                         "ANGULAR_SIZE",
                                         "ANGULAR_LOCATION",
                                         "DATUM",
                                         "DRAUGHTING_CALLOUT",
                                         "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE",
                                         "DIMENSIONAL_SIZE_WITH_PATH"};
  constexpr std::string_view kEnds[] = {"_TOLERANCE", "ANNOTATION_OCCURRENCE", "ANNOTATION_CURVE_OCCURRENCE",
                                        "ANNOTATION_TEXT_OCCURRENCE", "ANNOTATION_PLANE"};
  return std::find(std::begin(kWhole), std::end(kWhole), entity) != std::end(kWhole) ||
         std::any_of(std::begin(kEnds), std::end(kEnds),
                     [&](std::string_view end) { return entity.ends_with(end); });
}

bool in_name(char c) {
  return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

// The first name after an "=", past blanks and the parenthesis of an entity of several types.
std::string_view entity_after(std::string_view text, std::size_t equals) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n(", equals + 1);
  if (begin == std::string_view::npos) return {};
  const auto* const end = std::find_if_not(text.begin() + begin, text.end(), in_name);
  return text.substr(begin, static_cast<std::size_t>(end - text.begin()) - begin);
}

struct Dressed {
  bool names = false, letters = false, colors = false, layers = false, assemblies = false;
  void look_at(const ShapeStyle& style) {
    layers = layers || !style.layers.empty();
    for (const auto& color : style.colors) colors = colors || color.has_value();
  }
  void look_at(const TCollection_ExtendedString& name) {
    names = names || !name.IsEmpty();
    letters = letters || !name.IsAscii();
  }
  void look_at(const std::vector<CadNode>& nodes) {
    for (const CadNode& node : nodes) {
      look_at(node.style);
      look_at(node.instance_style);
      look_at(node.name);
      assemblies = assemblies || !node.children.empty();
      for (const StyledShape& each : node.styled) {
        look_at(each.style);
        look_at(each.name);
      }
      look_at(node.children);
    }
  }
};

}  // namespace

std::string pmi_of(std::span<const std::byte> step) {
  const std::string_view text(reinterpret_cast<const char*>(step.data()), step.size());
  std::size_t count = 0;
  std::string_view first;
  for (std::size_t at = 0; (at = text.find_first_of("'=", at)) != std::string_view::npos; ++at) {
    if (text[at] == '\'') {  // a doubled one in a text is two texts
      at = text.find('\'', at + 1);
      if (at == std::string_view::npos) break;
      continue;
    }
    const std::string_view entity = entity_after(text, at);
    if (!is_pmi(entity)) continue;
    ++count;
    if (first.empty()) first = entity;
  }
  if (count == 0) return "";
  return fmt::format("dimensions, tolerances or notes (PMI: {} as {})",
                     count == 1 ? "1 entity" : fmt::format("{} entities", count), first);
}

std::string no_room_for(const CadTree& tree, const std::string& format) {
  if (format == "step") return "";
  Dressed found;
  found.look_at(tree.roots);
  std::vector<std::string> lost;
  if (format == "brep" && found.names) lost.emplace_back("names");
  if (format == "brep" && found.colors) lost.emplace_back("colours");
  if (format == "brep" && found.layers) lost.emplace_back("layers");
  if (format == "iges" && found.letters) lost.emplace_back("letters of names that are not ASCII");
  if (found.assemblies) lost.emplace_back("assemblies");
  if (lost.size() < 2) return lost.empty() ? "" : lost.front();
  return fmt::format("{} and {}", fmt::join(lost.begin(), lost.end() - 1, ", "), lost.back());
}

}  // namespace flexel::cad
