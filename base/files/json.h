// JSON by nlohmann's library. Its parser and its writer are compiled once: each file that has them of its own takes seconds longer.
#pragma once
#include <cstddef>
#include <istream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace flexel {

// A limit on nesting: what parses, copies, writes and destroys the values recurses. No file of ours, and no glTF that a program
// wrote, is a tenth as deep.
constexpr std::size_t kDeepestJson = 500;

// How deep arrays and objects lie in one another; brackets in strings do not count. Of a text that is no JSON,
// up to where that shows.
[[nodiscard]] std::size_t json_depth(std::string_view text);

// The value; it `is_discarded()` where the text is no JSON or is deeper than kDeepestJson.
[[nodiscard]] nlohmann::ordered_json parse_json(std::string_view text);

// The same of what a stream holds; throws nlohmann::ordered_json::exception where that is no JSON. For files of our own programs.
[[nodiscard]] nlohmann::ordered_json load_json(std::istream& in);

// On one line, or with `indent` spaces a level. Bytes that are not UTF-8 become U+FFFD.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& json, int indent = -1);

}  // namespace flexel
