// A limit on nesting, asked before a JSON text is parsed: what copies, writes and destroys the values recurses.
#pragma once
#include <algorithm>
#include <cstddef>
#include <string_view>

namespace flexel {

// No file of ours, and no glTF that a program wrote, is a tenth as deep.
constexpr std::size_t kDeepestJson = 500;

// How deep arrays and objects lie in one another; brackets in strings do not count. Of a text that is no JSON,
// up to where that shows.
[[nodiscard]] inline std::size_t json_depth(std::string_view text) {
  std::size_t depth = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      in_string = c != '"';
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return deepest;
}

}  // namespace flexel
