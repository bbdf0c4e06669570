// Parses selections from the scene's tree.
#include "simulate/input/scene_selection.h"

#include <fmt/format.h>

#include "base/error.h"

namespace flexel::simulate {
namespace {

constexpr const char* kExample = "\"xmin\"";

template <class Fill>
Selection parse_shape(Selection::Kind kind, const SceneValue& value, const TableReader& outer,
                      const char* name, const Fill& fill) {
  TableReader reader(value, outer.file(), fmt::format("{} of \"where\"", name));
  Selection selection;
  selection.kind = kind;
  selection.origin = outer.place(value.line);
  fill(reader, selection);
  reader.finish();
  return selection;
}

Vec3 required_point(TableReader& reader, const char* key) {
  return reader.to_vector(reader.require(key, "[\"0 mm\", \"0 mm\", \"0 mm\"]"), Dimension::length, key);
}

// In one place, or swept along a path.
void parse_sphere(TableReader& reader, Selection& sphere) {
  const SceneValue* path = reader.find("path");
  if (!path) {
    sphere.point = required_point(reader, "centre");
  } else {
    if (reader.find("centre"))
      reader.fail(path->line, "sphere: give either \"centre\" or \"path\", along which it is swept");
    if (path->kind != SceneValue::Kind::array || path->items.size() < 2)
      reader.fail(path->line,
                  "sphere: \"path\" needs two places or more: [[\"0 mm\", 0, 0], [\"9 mm\", 0, 0]]");
    for (const SceneValue& place : path->items)
      sphere.members.emplace_back().point = reader.to_vector(place, Dimension::length, "path");
    sphere.point = sphere.members.front().point;
  }
  sphere.radius = reader.to_quantity(reader.require("radius", "\"5 mm\""), Dimension::length, "radius");
  if (!(sphere.radius > 0)) reader.fail("sphere: \"radius\" needs to be above 0");
}

Selection parse_table(const SceneValue& value, const TableReader& outer) {
  TableReader reader(value, outer.file(), "\"where\"");
  std::vector<Selection> found;
  if (const SceneValue* box = reader.find("box"))
    found.push_back(parse_shape(Selection::Kind::box, *box, outer, "box", [](TableReader& r, Selection& s) {
      s.min = required_point(r, "min");
      s.max = required_point(r, "max");
      if ((s.min.array() > s.max.array()).any()) r.fail("box: \"min\" lies above \"max\"");
    }));
  if (const SceneValue* sphere = reader.find("sphere"))
    found.push_back(parse_shape(Selection::Kind::sphere, *sphere, outer, "sphere", parse_sphere));
  if (const SceneValue* half = reader.find("half_space"))
    found.push_back(parse_shape(Selection::Kind::half_space, *half, outer, "half_space",
                                [](TableReader& r, Selection& s) {
                                  s.point = required_point(r, "point");
                                  (void)r.require("normal", "[0, 0, 1]");
                                  s.normal = *r.direction("normal");
                                }));
  if (const SceneValue* out = reader.find("not")) {
    Selection selection;
    selection.kind = Selection::Kind::complement;
    selection.members = {parse_selection(*out, outer)};
    selection.origin = outer.place(value.line);
    found.push_back(selection);
  }
  reader.finish();
  if (found.size() != 1)
    reader.fail(
        "a table in \"where\" needs exactly one of box, sphere, half_space and not; use a list to unite "
        "several");
  return found.front();
}

}  // namespace

Selection parse_selection(const SceneValue& value, const TableReader& reader) {
  if (value.kind == SceneValue::Kind::string) {
    if (value.text.empty()) reader.fail(value.line, "an empty name selects nothing");
    return select_by_name(value.text, reader.place(value.line));
  }
  if (value.kind == SceneValue::Kind::table) return parse_table(value, reader);
  if (value.kind != SceneValue::Kind::array || value.items.empty())
    reader.fail(
        value.line,
        fmt::format(
            "\"where\" in {} needs a name (\"part/12\", {}), a table ({{ box = ... }}) or a list of those",
            reader.title(), kExample));
  Selection selection;
  selection.kind = Selection::Kind::any_of;
  selection.origin = reader.place(value.line);
  for (const SceneValue& item : value.items) selection.members.push_back(parse_selection(item, reader));
  return selection;
}

Selection require_where(TableReader& reader) {
  return parse_selection(reader.require("where", kExample), reader);
}

Selection parse_where(const std::string& text, const std::string& origin) {
  if (text.empty()) throw InputError(origin, "an empty name selects nothing");
  if (text.front() != '{' && text.front() != '[' && text.front() != '"') return select_by_name(text, origin);
  SceneValue root;
  try {
    root = read_toml("where = " + text, origin);
  } catch (const InputError& error) {
    throw InputError(origin, fmt::format("{}: {}", text, error.what()));
  }
  root.line = 0;
  for (auto& member : root.members) member.value.line = 0;
  TableReader reader(root, origin, origin);
  return require_where(reader);
}

}  // namespace flexel::simulate
