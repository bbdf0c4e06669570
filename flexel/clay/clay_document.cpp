// Numbers have 17 digits, so that the scene is what was done to the last bit.
#include "flexel/clay/clay_document.h"

#include <fmt/format.h>

namespace flexel::clay {
namespace {

std::string lengths(const Vec3& v) {
  return fmt::format("[\"{:.17g} m\", \"{:.17g} m\", \"{:.17g} m\"]", v.x(), v.y(), v.z());
}

std::string move_of(const ClayTool& tool, std::size_t number) {
  std::string text = fmt::format("\n[[move]]\nname = \"tool {}\"\nwhere = {}\ndisplacement = {}\n", number,
                                 tool.where, lengths(tool.pose.displacement));
  const double angle = tool.pose.turn.norm();
  if (angle > 0) {
    const Vec3 axis = tool.pose.turn / angle;
    text += fmt::format(
        "rotation = {{ axis = [{:.17g}, {:.17g}, {:.17g}], through = {}, angle = \"{:.17g} rad\" }}\n",
        axis.x(), axis.y(), axis.z(), lengths(tool.middle), angle);
  }
  return text;
}

// Asks for it in the [run] that the text has, or in one of its own.
std::string kept_text(std::string text) {
  constexpr const char* kTable = "[run]";
  const std::string keep = "renormalise = true\n";
  std::size_t at = text.starts_with(kTable) ? 0 : text.find(std::string("\n") + kTable);
  if (at == text.npos) return text + "\n[run]\n" + keep;
  at = std::min(text.find('\n', at + 1), text.size() - 1);
  return text.insert(at + 1, keep);
}

}  // namespace

std::string where_of_name(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + '"';
}

std::string where_of_ball(const Vec3& centre, double radius) {
  return fmt::format("{{ sphere = {{ centre = {}, radius = \"{:.17g} m\" }} }}", lengths(centre), radius);
}

std::string scene_text(const ClayDocument& document, const std::string& base, bool keep) {
  std::string text;
  if (!document.material.empty()) text += "material = " + where_of_name(document.material) + "\n";
  text += base;
  if (!text.empty() && text.back() != '\n') text += '\n';
  for (const std::string& name : document.holds) text += "\n[[fix]]\nwhere = " + where_of_name(name) + "\n";
  for (std::size_t t = 0; t < document.tools.size(); ++t) text += move_of(document.tools[t], t + 1);
  return keep ? kept_text(std::move(text)) : text;
}

}  // namespace flexel::clay
