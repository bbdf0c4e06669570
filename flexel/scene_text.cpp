// Numbers are written with all digits, so that reading gives the same bits.
#include "flexel/scene_text.h"
#include "simulate/effects/gravity.h"

#include <fmt/format.h>

namespace flexel::commands {
namespace {

// A TOML string.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') result += '\\';
    if (static_cast<unsigned char>(letter) < 0x20)
      result += fmt::format("\\u{:04x}", static_cast<unsigned>(letter));
    else
      result += letter;
  }
  return result + "\"";
}

std::string quantity(double value, const char* unit) {
  return fmt::format("\"{:.17g} {}\"", value, unit);
}

std::string vector(const Vec3& value, const char* unit) {
  return fmt::format("[{}, {}, {}]", quantity(value.x(), unit), quantity(value.y(), unit),
                     quantity(value.z(), unit));
}

std::string places(const std::vector<simulate::Selection>& path) {
  std::string text;
  for (const simulate::Selection& each : path) text += (text.empty() ? "" : ", ") + vector(each.point, "m");
  return "[" + text + "]";
}

std::string direction_text(const Vec3& value) {
  return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", value.x(), value.y(), value.z());
}

std::string where_text(const simulate::Selection& selection) {
  switch (selection.kind) {
    case simulate::Selection::Kind::name:
      return quoted(selection.name);
    case simulate::Selection::Kind::box:
      return fmt::format("{{ box = {{ min = {}, max = {} }} }}", vector(selection.min, "m"),
                         vector(selection.max, "m"));
    case simulate::Selection::Kind::sphere:
      if (!selection.members.empty())
        return fmt::format("{{ sphere = {{ path = {}, radius = {} }} }}", places(selection.members),
                           quantity(selection.radius, "m"));
      return fmt::format("{{ sphere = {{ centre = {}, radius = {} }} }}", vector(selection.point, "m"),
                         quantity(selection.radius, "m"));
    case simulate::Selection::Kind::half_space:
      return fmt::format("{{ half_space = {{ point = {}, normal = {} }} }}", vector(selection.point, "m"),
                         direction_text(selection.normal));
    case simulate::Selection::Kind::complement:
      return fmt::format("{{ not = {} }}", where_text(selection.members.front()));
    case simulate::Selection::Kind::any_of:
      break;
  }
  std::string members;
  for (const simulate::Selection& member : selection.members)
    members += (members.empty() ? "" : ", ") + where_text(member);
  return "[" + members + "]";
}

std::string infill_text(const simulate::Infill& infill) {
  std::string text;
  if (infill.share) text += fmt::format("infill = {:.17g}\n", *infill.share);
  if (infill.shell) text += fmt::format("shell = {}\n", quantity(*infill.shell, "m"));
  return text;
}

std::string tie_text(const simulate::Tie& tie) {
  std::string text = fmt::format("\n[[{}]]\nname = {}\nwhere = {}\n", tie.is_move ? "move" : "fix",
                                 quoted(tie.name), where_text(tie.where));
  if (!tie.is_move) return text;
  if (tie.motion.angle == 0)
    return text + fmt::format("displacement = {}\n", vector(tie.motion.translation, "m"));
  return text + fmt::format("rotation = {{ axis = {}, through = {}, angle = {}{} }}\n",
                            direction_text(tie.motion.axis), vector(tie.motion.through, "m"),
                            quantity(tie.motion.angle, "rad"),
                            tie.motion.arc_from ? ", arc_from = " + vector(*tie.motion.arc_from, "m") : "");
}

std::string load_text(const simulate::Load& load) {
  std::string text =
      fmt::format("\n[[load]]\nname = {}\nwhere = {}\n", quoted(load.name), where_text(load.where));
  if (load.force)
    text += fmt::format("{} = {}\n", load.bearing ? "bearing" : "force", vector(*load.force, "N"));
  if (load.torque) text += fmt::format("torque = {}\n", vector(*load.torque, "N m"));
  if (load.pressure) text += fmt::format("pressure = {}\n", quantity(*load.pressure, "Pa"));
  if (load.follower) text += "follower = true\n";
  return text;
}

}  // namespace

SceneText scene_text(const simulate::Scene& scene) {
  SceneText text;
  if (!scene.model.empty()) text.keys += fmt::format("model = {}\n", quoted(scene.model));
  if (!scene.material.empty()) text.keys += fmt::format("material = {}\n", quoted(scene.material));
  text.keys += infill_text(scene.infill);
  for (const auto& [name, part] : scene.parts) {
    text.tables += fmt::format("\n[parts.{}]\n", quoted(name));
    if (!part.material.empty()) text.tables += fmt::format("material = {}\n", quoted(part.material));
    text.tables += infill_text(part.infill);
  }
  for (const simulate::Tie& tie : scene.get<simulate::Supports>().ties) text.tables += tie_text(tie);
  for (const simulate::Load& load : scene.get<simulate::Loads>().loads) text.tables += load_text(load);
  for (const simulate::Probe& probe : scene.probes)
    text.tables +=
        fmt::format("\n[[probe]]\nname = {}\n{}\n", quoted(probe.name),
                    probe.at ? "at = " + vector(*probe.at, "m") : "where = " + where_text(*probe.where));
  if (const std::optional<Vec3>& acceleration = scene.get<simulate::Gravity>().acceleration)
    text.tables += fmt::format("\n[gravity]\nacceleration = {}\n", vector(*acceleration, "m/s^2"));
  return text;
}

}  // namespace flexel::commands
