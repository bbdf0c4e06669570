// [[fix]], [[move]], and [[load]] by a rigid link, of a scene.
#include <fmt/format.h>

#include "simulate/conditions/rotation_key.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/input/scene_selection.h"

namespace flexel::simulate {
namespace {

std::array<bool, 3> parse_held_axes(TableReader& reader) {
  const std::optional<std::string> text = reader.text("axes");
  if (!text) return {true, true, true};
  std::array<bool, 3> axes{false, false, false};
  for (const char letter : *text) {
    if (letter < 'x' || letter > 'z' || axes[static_cast<std::size_t>(letter - 'x')])
      reader.fail(
          reader.find("axes")->line,
          fmt::format("\"axes\" = \"{}\": use each of x, y and z once at most, for example \"xy\"", *text));
    axes[static_cast<std::size_t>(letter - 'x')] = true;
  }
  if (text->empty()) reader.fail("\"axes\" names no axis");
  return axes;
}

void parse_displacement(TableReader& reader, Tie& tie) {
  const SceneValue* value = reader.find("displacement");
  if (!value) return;
  if (value->kind != SceneValue::Kind::array || value->items.size() != 3)
    reader.fail(value->line,
                "\"displacement\" needs three values, each a length or \"free\", for example "
                "[\"1 mm\", \"free\", \"0 mm\"]");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const SceneValue& item = value->items[axis];
    tie.axes[axis] = !(item.kind == SceneValue::Kind::string && item.text == "free");
    if (tie.axes[axis])
      tie.motion.translation[static_cast<Eigen::Index>(axis)] =
          reader.to_quantity(item, Dimension::length, "displacement");
  }
}

Tie parse_link(TableReader& reader) {
  Tie tie;
  tie.origin = reader.place();
  tie.where = require_where(reader);
  tie.name = reader.text("name").value_or(describe(tie.where));
  (void)reader.text("link");
  const std::optional<Vec3> force = reader.vector("force", Dimension::force);
  const std::optional<Vec3> torque = reader.vector("torque", Dimension::torque);
  tie.link = LinkLoad{force.value_or(Vec3::Zero()), torque.value_or(Vec3::Zero()),
                      reader.vector("at", Dimension::length), parse_follower(reader)};
  tie.course = parse_course(reader);
  for (const char* other : {"pressure", "bearing"})
    if (reader.find(other))
      reader.fail(fmt::format("a rigid link takes \"force\" and \"torque\", not \"{}\"", other));
  reader.finish();
  if (!force && !torque)
    reader.fail(
        "[[load]] with a rigid link needs \"force\" or \"torque\", for example [\"0 N\", \"0 N\", \"-100 "
        "N\"]");
  if (tie.link->at && !force) reader.fail("\"at\" says where a \"force\" acts; give one");
  return tie;
}

}  // namespace

void Supports::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("fix")) {
    TableReader reader(*table, scene.file(), "[[fix]]");
    Tie tie;
    tie.origin = reader.place();
    tie.where = require_where(reader);
    tie.name = reader.text("name").value_or(describe(tie.where));
    tie.axes = parse_held_axes(reader);
    reader.finish();
    parameters.ties.push_back(tie);
  }
  for (const SceneValue* table : scene.tables("move")) {
    TableReader reader(*table, scene.file(), "[[move]]");
    Tie tie;
    tie.is_move = true;
    tie.origin = reader.place();
    tie.where = require_where(reader);
    tie.name = reader.text("name").value_or(describe(tie.where));
    parse_displacement(reader, tie);
    read_rotation(reader, tie.motion);
    if (reader.find("rotation") && !(tie.axes[0] && tie.axes[1] && tie.axes[2]))
      reader.fail("[[move]] has a rotation and a free axis; a rotation leads all three");
    tie.course = parse_course(reader);
    reader.finish();
    if (!reader.find("displacement") && !reader.find("rotation"))
      reader.fail(
          "[[move]] needs \"displacement\" (for example [\"1 mm\", \"0 mm\", \"0 mm\"]) or \"rotation\"");
    if (!tie.axes[0] && !tie.axes[1] && !tie.axes[2]) reader.fail("[[move]] leaves every axis free");
    parameters.ties.push_back(tie);
  }
  for (const SceneValue* table : scene.tables("load")) {
    TableReader reader(*table, scene.file(), "[[load]]");
    if (reader.text("link") == "rigid") parameters.ties.push_back(parse_link(reader));
  }
}

}  // namespace flexel::simulate
