// A limit on dotted keys of TOML, asked before the parser, which recurses into them.
#pragma once
#include <string>
#include <string_view>

namespace flexel::simulate {

// Parts of a key, as in "a.b.c" (three). A scene needs no more than four; toml++ allows 256 tables and arrays
// in one another, each with such a key.
constexpr std::size_t kLongestKey = 32;

// Throws InputError("name:line", ...) where a key has more parts.
void refuse_long_keys(std::string_view text, const std::string& name);

}  // namespace flexel::simulate
