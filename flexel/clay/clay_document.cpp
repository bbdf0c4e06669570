// Numbers have 17 digits, so that the scene is what was done to the last bit.
#include "flexel/clay/clay_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "simulate/scene/scene.h"

namespace flexel::clay {
namespace {

std::string lengths(const Vec3& v) {
  return fmt::format("[\"{:.17g} m\", \"{:.17g} m\", \"{:.17g} m\"]", v.x(), v.y(), v.z());
}

std::string move_of(const ClayTool& tool, std::size_t number) {
  std::string text =
      fmt::format("\n[[{}]]\nname = \"tool {}\"\n{}{}\ndisplacement = {}\n", tool.shape ? "indenter" : "move",
                  number, tool.shape ? "" : "where = ", tool.where, lengths(tool.pose.displacement));
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
  const std::string keep = "renormalise = true\n";
  for (std::size_t line = 0, next = 0; line < text.size(); line = next) {
    next = std::min(text.find('\n', line), text.size() - 1) + 1;
    const std::size_t first = text.find_first_not_of(" \t", line);
    if (first != text.npos && text.compare(first, 5, "[run]") == 0) return text.insert(next, keep);
  }
  return text + "\n[run]\n" + keep;
}

// Of all their bodies; a body that several have counts once.
std::size_t elements_of(const std::vector<ClayDocument>& documents) {
  std::set<const Body*> bodies;
  std::size_t count = 0;
  for (const ClayDocument& document : documents)
    for (const Body* body : {document.start.body.get(), document.now.body.get()})
      if (body != nullptr && bodies.insert(body).second) count += body->element_count();
  return count;
}

}  // namespace

void forget_oldest(std::vector<ClayDocument>& undo, std::size_t most, std::size_t most_elements) {
  while (undo.size() > 1 && (undo.size() > most || elements_of(undo) > most_elements))
    undo.erase(undo.begin());
}

std::string where_of_name(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + '"';
}

std::string shape_text(const simulate::IndenterShape& shape, const simulate::IndenterPlace& place) {
  const Vec3& n = place.normal;
  const std::string normal = fmt::format(", normal = [{:.17g}, {:.17g}, {:.17g}]", n.x(), n.y(), n.z());
  return fmt::format("{} = {{ centre = {}{}, radius = \"{:.17g} m\" }}", shape.plate ? "plate" : "ball",
                     lengths(place.centre), shape.plate ? normal : "", shape.radius);
}

int ClayTool::steps(const ToolPose& way) const {
  if (!shape) return 1;
  const double length = way.displacement.norm() + radius * way.turn.norm();
  return std::max(1,
                  static_cast<int>(std::ceil(length / (simulate::kIndenterStep * shape->rounding) - 1e-9)));
}

std::string where_of_ball(const Vec3& centre, double radius) {
  return fmt::format("{{ sphere = {{ centre = {}, radius = \"{:.17g} m\" }} }}", lengths(centre), radius);
}

std::string change_text(const Act& act) {
  std::string text =
      fmt::format("\n[[event]]\ndo = \"{}\"\npositions = \"rest\"\nwhere = {}\n",
                  act.kind == Act::Kind::carve ? "carve" : "fuse", where_of_ball(act.at, act.radius));
  if (act.kind == Act::Kind::glue) text += fmt::format("within = \"{:.17g} m\"\n", act.within);
  return text;
}

std::string change_text(const std::vector<CarvedWay>& ways) {
  std::string where;
  for (const CarvedWay& way : ways) {
    if (!where.empty()) where += ",\n  ";
    if (way.path.size() == 1) {
      where += where_of_ball(way.path.front(), way.radius);
      continue;
    }
    std::string path;
    for (const Vec3& place : way.path) path += (path.empty() ? "" : ",\n    ") + lengths(place);
    where += fmt::format("{{ sphere = {{ path = [{}], radius = \"{:.17g} m\" }} }}", path, way.radius);
  }
  return fmt::format("\n[[event]]\ndo = \"carve\"\npositions = \"rest\"\nwhere = {}\n",
                     ways.size() == 1 ? where : "[" + where + "]");
}

std::string scene_text(const ClayDocument& document, const std::string& base, bool keep) {
  std::string text;
  if (!document.material.empty()) text += "material = " + where_of_name(document.material) + "\n";
  text += base;
  if (!text.empty() && text.back() != '\n') text += '\n';
  for (const auto& [part, material] : document.painted)
    text += fmt::format("\n[parts.{}]\nmaterial = {}\n", where_of_name(part), where_of_name(material));
  for (const std::string& change : document.changes) text += change;
  for (const std::string& name : document.holds) text += "\n[[fix]]\nwhere = " + where_of_name(name) + "\n";
  for (std::size_t t = 0; t < document.tools.size(); ++t) text += move_of(document.tools[t], t + 1);
  return keep ? kept_text(std::move(text)) : text;
}

void refuse_unkept(const std::string& base, const std::string& name) {
  const simulate::Scene scene = simulate::parse_scene(base, name);
  if (scene.run.renormalise || scene.run.time) return;  // refuse_unled tells why not
  ClayDocument document;
  if (scene.material.empty()) document.material = "PLA";
  document.holds = {"xmin"};
  document.tools.emplace_back().where = where_of_name("xmax");
  Act carve{Act::Kind::carve, "", {}};
  carve.radius = 1;
  document.changes = {change_text(carve)};
  ClayTool& pusher = document.tools.emplace_back();
  pusher.shape = {false, 1, 1};
  pusher.where = shape_text(*pusher.shape, {});
  document.painted["a part that hands paint"] = "PLA";
  std::string why = "\"renormalise\" is nowhere in its [run]";
  try {
    if (simulate::parse_scene(scene_text(document, base, true), "then").run.renormalise) return;
  } catch (const InputError& error) {
    why = fmt::format("{}: {}", error.where(), error.what());
  }
  throw InputError(name, fmt::format("what hands do cannot be added to it ({}): write [run], [[fix]], "
                                     "[[move]], [[indenter]] and [parts.NAME] as tables of "
                                     "their own",
                                     why));
}

}  // namespace flexel::clay
