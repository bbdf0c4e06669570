// The library of materials for people and programs.
#pragma once
#include <string>

namespace flexel::commands {

// The library as lines for people, as a table in Markdown (docs/reference/materials.md holds it), as JSON (SI), and the
// names alone, a line each.
[[nodiscard]] std::string materials_text();
[[nodiscard]] std::string materials_markdown();
[[nodiscard]] std::string materials_json();
[[nodiscard]] std::string materials_words();

}  // namespace flexel::commands
