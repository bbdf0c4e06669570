// Reads the tables of a scene: kinds are checked, units are required, every key that was asked for is
// remembered so that an unknown one can be answered with the nearest known one.
#include "simulate/input/scene_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/nearest_word.h"

namespace flexel::simulate {

const char* kind_name(SceneValue::Kind kind) {
  switch (kind) {
    case SceneValue::Kind::string:
      return "a text";
    case SceneValue::Kind::number:
      return "a number";
    case SceneValue::Kind::boolean:
      return "true or false";
    case SceneValue::Kind::array:
      return "a list";
    case SceneValue::Kind::table:
      return "a table";
    case SceneValue::Kind::other:
      break;
  }
  return "a date or time";
}

TableReader::TableReader(const SceneValue& table, std::string file, std::string title)
    : table_(&table), file_(std::move(file)), title_(std::move(title)) {
  if (table.kind != SceneValue::Kind::table)
    fail(fmt::format("{} is {}; it needs to be a table", title_, kind_name(table.kind)));
}

std::string TableReader::place(int line) const {
  return line > 0 ? fmt::format("{}:{}", file_, line) : file_;
}

void TableReader::fail(int line, const std::string& what) const {
  throw InputError(place(line), what);
}

const SceneValue* TableReader::find(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  for (const auto& [name, value] : table_->members)
    if (name == key) return &value;
  return nullptr;
}

const SceneValue& TableReader::require(const std::string& key, const std::string& example) {
  const SceneValue* value = find(key);
  if (!value) {
    // A mistyped required key is better answered as an unknown one.
    for (const auto& [name, member] : table_->members)
      if (nearest_word(name, {key}) == key && std::find(known_.begin(), known_.end(), name) == known_.end())
        fail(member.line, fmt::format("unknown key \"{}\" in {}; did you mean \"{}\"?", name, title_, key));
    fail(fmt::format("{} needs \"{}\", for example {} = {}", title_, key, key, example));
  }
  return *value;
}

std::optional<std::string> TableReader::text(const std::string& key) {
  const SceneValue* value = find(key);
  if (!value) return std::nullopt;
  if (value->kind != SceneValue::Kind::string)
    fail(value->line,
         fmt::format("\"{}\" in {} is {}; it needs to be a text", key, title_, kind_name(value->kind)));
  return value->text;
}

std::optional<double> TableReader::number(const std::string& key) {
  const SceneValue* value = find(key);
  if (!value) return std::nullopt;
  if (value->kind != SceneValue::Kind::number || !std::isfinite(value->number))
    fail(value->line, fmt::format("\"{}\" in {} needs to be a finite number without a unit", key, title_));
  return value->number;
}

double TableReader::to_quantity(const SceneValue& value, Dimension dimension, const std::string& key) const {
  if (value.kind == SceneValue::Kind::number) {
    if (value.number == 0 && dimension != Dimension::temperature) return 0;
    if (dimension == Dimension::share && std::isfinite(value.number)) return value.number;
    fail(value.line, fmt::format("\"{}\" in {} is a bare number; it needs a unit of {}, for example \"{}\"",
                                 key, title_, dimension_name(dimension), dimension_example(dimension)));
  }
  if (value.kind != SceneValue::Kind::string)
    fail(value.line,
         fmt::format("\"{}\" in {} is {}; it needs to be a {}, for example \"{}\"", key, title_,
                     kind_name(value.kind), dimension_name(dimension), dimension_example(dimension)));
  try {
    return parse_quantity(value.text, dimension);
  } catch (const InputError& error) {
    fail(value.line, fmt::format("\"{}\" in {}: {}", key, title_, error.what()));
  }
}

std::optional<double> TableReader::quantity(const std::string& key, Dimension dimension) {
  const SceneValue* value = find(key);
  if (!value) return std::nullopt;
  return to_quantity(*value, dimension, key);
}

Vec3 TableReader::to_vector(const SceneValue& value, Dimension dimension, const std::string& key) const {
  if (value.kind != SceneValue::Kind::array || value.items.size() != 3)
    fail(value.line, fmt::format("\"{}\" in {} needs three values [x, y, z], for example [\"{}\", 0, 0]", key,
                                 title_, dimension_example(dimension)));
  Vec3 result;
  for (int axis = 0; axis < 3; ++axis)
    result[axis] = to_quantity(value.items[static_cast<std::size_t>(axis)], dimension, key);
  return result;
}

std::optional<Vec3> TableReader::vector(const std::string& key, Dimension dimension) {
  const SceneValue* value = find(key);
  if (!value) return std::nullopt;
  return to_vector(*value, dimension, key);
}

std::optional<Vec3> TableReader::direction(const std::string& key) {
  const SceneValue* value = find(key);
  if (!value) return std::nullopt;
  Vec3 result = Vec3::Zero();
  bool right = value->kind == SceneValue::Kind::array && value->items.size() == 3;
  for (std::size_t axis = 0; right && axis < 3; ++axis) {
    right = value->items[axis].kind == SceneValue::Kind::number && std::isfinite(value->items[axis].number);
    result[static_cast<Eigen::Index>(axis)] = value->items[axis].number;
  }
  if (!right || !(result.norm() > 0))
    fail(value->line,
         fmt::format(
             "\"{}\" in {} needs a direction of three numbers that are not all 0, for example [0, 0, 1]", key,
             title_));
  return result.normalized();
}

std::vector<const SceneValue*> TableReader::tables(const std::string& key) {
  const SceneValue* value = find(key);
  if (!value) return {};
  if (value->kind == SceneValue::Kind::table) return {value};
  std::vector<const SceneValue*> result;
  bool right = value->kind == SceneValue::Kind::array;
  for (const SceneValue& item : value->items) {
    right = right && item.kind == SceneValue::Kind::table;
    result.push_back(&item);
  }
  if (!right) fail(value->line, fmt::format("\"{}\" needs to be written as [[{}]]", key, key));
  return result;
}

void TableReader::finish() const {
  for (const auto& [name, value] : table_->members)
    if (std::find(known_.begin(), known_.end(), name) == known_.end()) {
      const std::string nearest = did_you_mean(name, known_);
      std::string hint = nearest;
      if (nearest.empty()) hint = fmt::format("; known keys: {}", fmt::join(known_, ", "));
      fail(value.line, fmt::format("unknown key \"{}\" in {}{}", name, title_, hint));
    }
}

}  // namespace flexel::simulate
