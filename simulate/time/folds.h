// What a timed run says of matter that turned inside out.
#pragma once
#include <string>
#include <vector>

#include "formats/body.h"

namespace flexel {

// "`what` near (...) turned inside out", `at` [m] at rest, and what to do about it.
[[nodiscard]] std::string folds_at(const char* what, const Vec3& at);

// That of the cell with the least volume, its elements displaced by `displacement` [m] (elements).
[[nodiscard]] std::string where_it_folds(const Body& body, const std::vector<Vec3>& displacement);

}  // namespace flexel
