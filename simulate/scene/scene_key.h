// A key of a scene: what it takes and what it means.
#pragma once
#include <optional>
#include <string>

#include "base/units.h"

namespace flexel::simulate {

enum class KeyKind { text, number, whole_number, flag, quantity, vector, direction, selection, list, table };

struct SceneKey {
  // Where it may stand: "" (top of the scene), "[gravity]", "[[load]]", "[parts.NAME]"; "source of [gravity]"
  // for a table that is written in one line.
  std::string table;
  std::string key;
  KeyKind kind = KeyKind::text;
  std::optional<Dimension> unit;  // of quantities, vectors and lists of them
  std::string standard;           // default; "required"; "": nothing
  std::string help;               // one line
};

}  // namespace flexel::simulate
