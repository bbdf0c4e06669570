// Counts the dots that follow one another without anything that ends a key. Strings and comments are passed
// over; a text that is no TOML is the parser's to refuse.
#include "simulate/input/key_depth.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace flexel::simulate {
namespace {

// Index after the string that begins at `at`; one on a single line ends there at the latest.
std::size_t after_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const std::string three(3, quote);
  const bool lines = text.substr(at, 3) == three;
  for (std::size_t i = at + (lines ? 3 : 1); i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"') {
      ++i;
    } else if (!lines && (text[i] == quote || text[i] == '\n')) {
      return text[i] == quote ? i + 1 : i;
    } else if (lines && text.substr(i, 3) == three) {
      i += 3;  // up to two quotes more are the string's own
      for (int more = 0; more < 2 && i < text.size() && text[i] == quote; ++more) ++i;
      return i;
    }
  }
  return text.size();
}

}  // namespace

void refuse_long_keys(std::string_view text, const std::string& name) {
  std::size_t dots = 0;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      i = after_string(text, i);
      continue;
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '.') ++dots;
    if (std::string_view("\n=,[]{}").find(c) != std::string_view::npos) dots = 0;
    if (dots >= kLongestKey)
      throw InputError(fmt::format("{}:{}", name, 1 + std::count(text.begin(), text.begin() + i, '\n')),
                       fmt::format("a key has more than {} parts (a.b.c has three), and no scene needs them",
                                   kLongestKey));
    ++i;
  }
}

}  // namespace flexel::simulate
