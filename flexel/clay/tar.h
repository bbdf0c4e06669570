// Files in one, as tar has them (POSIX.1-1988, ustar).
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace flexel::clay {

// (name, bytes) each; names of at most 99 characters, files below 8 GiB. Repeatable: no dates, no owners.
[[nodiscard]] std::string tar_of(const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace flexel::clay
