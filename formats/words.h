// What the readers of text files have in common.
#pragma once
#include <algorithm>
#include <string>
#include <string_view>

namespace flexel {

[[nodiscard]] inline bool blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r') || c == '\0';
}

// A word of a file as a message shows it: its beginning, with "?" for what a terminal may not print.
[[nodiscard]] inline std::string shown(std::string_view word) {
  std::string text(word.substr(0, 40));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

}  // namespace flexel
