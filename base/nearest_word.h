// "Did you mean": the word of a list with the least edit distance from a mistyped one.
#pragma once
#include <string>
#include <vector>

namespace flexel {

// The candidate nearest to `word` by edit distance, or "" where none is within a third of its length (at
// least 2 edits).
[[nodiscard]] std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);
// `; did you mean "X"?` or "".
[[nodiscard]] std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace flexel
