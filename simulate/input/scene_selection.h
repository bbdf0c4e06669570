// Selections as a scene or an option writes them.
#pragma once
#include "simulate/input/scene_table.h"
#include "simulate/input/selection.h"

namespace flexel::simulate {

// `where = "bracket/12"`, a list of selections, or one of
//   { box = { min = [..], max = [..] } }          { sphere = { centre or path = [..], radius = ".." } }
//   { half_space = { point = [..], normal = [..] } }   { not = SELECTION }
[[nodiscard]] Selection parse_selection(const SceneValue& value, const TableReader& reader);

// The required key "where" of a table.
[[nodiscard]] Selection require_where(TableReader& reader);

// The same from an option's text: a name, or anything above in TOML ("[\"xmin\", \"ymin\"]", "{ sphere = ...
// }"). `origin` is the option's name for messages.
[[nodiscard]] Selection parse_where(const std::string& text, const std::string& origin);

}  // namespace flexel::simulate
