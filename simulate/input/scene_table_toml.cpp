// The only file that sees toml++: copies its tree into SceneValue, keeping each value's line.
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "base/number_range.h"
#include "simulate/input/key_depth.h"
#include "simulate/input/scene_table.h"

namespace flexel::simulate {
namespace {

int line_of(const toml::node& node) {
  return static_cast<int>(node.source().begin.line);
}

SceneValue convert(const toml::node& node);

void convert_table(const toml::table& table, SceneValue& value) {
  value.kind = SceneValue::Kind::table;
  for (const auto& [key, member] : table) {
    SceneValue converted = convert(member);
    // The key's own line says where a mistyped key is, also where its value begins further down.
    converted.line = static_cast<int>(key.source().begin.line);
    value.members.push_back({std::string(key.str()), std::move(converted)});
  }
  std::stable_sort(value.members.begin(), value.members.end(),
                   [](const auto& a, const auto& b) { return a.value.line < b.value.line; });
}

SceneValue convert(const toml::node& node) {
  SceneValue value;
  value.line = line_of(node);
  if (const auto* text = node.as_string()) {
    value.kind = SceneValue::Kind::string;
    value.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    value.kind = SceneValue::Kind::number;
    value.number = static_cast<double>(integer->get());
  } else if (const auto* real = node.as_floating_point()) {
    value.kind = SceneValue::Kind::number;
    value.number = real->get();
  } else if (const auto* flag = node.as_boolean()) {
    value.kind = SceneValue::Kind::boolean;
    value.flag = flag->get();
  } else if (const auto* array = node.as_array()) {
    value.kind = SceneValue::Kind::array;
    for (const auto& item : *array) value.items.push_back(convert(item));
  } else if (const auto* table = node.as_table()) {
    convert_table(*table, value);
  }
  return value;
}

// NaN, infinity and numbers beyond all measure mean nothing in any key.
void refuse_wild_numbers(const SceneValue& value, const std::string& key, const std::string& name) {
  if (value.kind == SceneValue::Kind::number && !is_readable_number(value.number))
    throw InputError(name + ":" + std::to_string(value.line),
                     fmt::format("\"{}\" holds {}: a number needs to be finite, and at most 1e35 in size",
                                 key, value.number));
  for (const SceneValue& item : value.items) refuse_wild_numbers(item, key, name);
  for (const auto& [own, member] : value.members) refuse_wild_numbers(member, own, name);
}

}  // namespace

SceneValue read_toml(const std::string& text, const std::string& name) {
  refuse_long_keys(text, name);
  try {
    SceneValue root = convert(toml::parse(text, name));
    root.line = 1;
    refuse_wild_numbers(root, name, name);
    return root;
  } catch (const toml::parse_error& error) {
    throw InputError(name + ":" + std::to_string(error.source().begin.line),
                     std::string(error.description()));
  }
}

}  // namespace flexel::simulate
