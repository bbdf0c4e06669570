// Small functions on text, for readers and messages.
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

// `text` as one line: every run of white space is a blank, none at its ends.
[[nodiscard]] inline std::string one_line(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const bool space = c == '\n' || c == '\r' || c == '\t' || c == ' ';
    if (space && (line.empty() || line.back() == ' ')) continue;
    line += space ? ' ' : c;
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

}  // namespace flexel
