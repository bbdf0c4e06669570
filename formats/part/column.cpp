// Columns of a surface: names, checks, and joining those of several files.
#include "formats/part/column.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/error.h"

namespace flexel {
namespace {

bool plain(char c) {
  return (std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 128) ||
         c == '_' || c == '-' || c == '.';
}

double missing_value(const std::string& name) {
  return name == kColorColumn ? 1 : 0;
}

// Rows of `components` numbers become rows of `more`.
void widen(Column& column, int more, double missing) {
  if (column.components >= more) return;
  const std::size_t rows = column.values.size() / static_cast<std::size_t>(column.components);
  std::vector<double> values;
  values.reserve(rows * static_cast<std::size_t>(more));
  for (std::size_t row = 0; row < rows; ++row)
    for (int i = 0; i < more; ++i)
      values.push_back(
          i < column.components
              ? column.values[row * static_cast<std::size_t>(column.components) + static_cast<std::size_t>(i)]
              : missing);
  column.values = std::move(values);
  column.components = more;
}

}  // namespace

bool valid_column_name(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), plain);
}

std::string column_name(const std::string& text) {
  std::string name = text.empty() ? "_" : text;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !plain(c); }, '_');
  return name;
}

void check_columns(const Columns& columns, std::size_t count, const char* what, const std::string& where) {
  const auto fail = [&](const std::string& name, const std::string& why) {
    throw InputError(where, fmt::format("the surface is damaged: {} \"{}\" {}", what, name, why));
  };
  for (const auto& [name, column] : columns) {
    if (!valid_column_name(name)) fail(name, "is not the name of a column");
    if (column.components < 1) fail(name, "has no components");
    const std::size_t wanted = count * static_cast<std::size_t>(column.components);
    if (column.values.size() != wanted)
      fail(name, fmt::format("has {} values in place of {}", column.values.size(), wanted));
    const bool finite = std::all_of(column.values.begin(), column.values.end(),
                                    [](double value) { return std::isfinite(value); });
    if (!finite) fail(name, "has a value that is not finite");
    if (name != kColorColumn) continue;
    if (column.components != 3 && column.components != 4) fail(name, "has neither 3 nor 4 components");
    const bool in_range = std::all_of(column.values.begin(), column.values.end(),
                                      [](double value) { return value >= 0 && value <= 1; });
    if (!in_range) fail(name, "has a value outside [0, 1]");
  }
}

void append_columns(Columns& columns, std::size_t count, const Columns& other, std::size_t other_count) {
  for (const auto& [name, column] : other) {
    const auto [entry, added] = columns.try_emplace(name, Column{column.components, {}});
    if (added)
      entry->second.values.assign(count * static_cast<std::size_t>(column.components), missing_value(name));
    else
      widen(entry->second, column.components, missing_value(name));
  }
  for (auto& [name, column] : columns) {
    const auto found = other.find(name);
    if (found == other.end()) {
      column.values.resize((count + other_count) * static_cast<std::size_t>(column.components),
                           missing_value(name));
      continue;
    }
    Column added = found->second;
    widen(added, column.components, missing_value(name));
    column.values.insert(column.values.end(), added.values.begin(), added.values.end());
  }
}

}  // namespace flexel
