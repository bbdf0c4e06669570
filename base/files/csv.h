// Comma-separated values, as RFC 4180 has them: a field with commas, quotes or line ends stands in quotes, its own doubled.
#pragma once
#include <istream>
#include <string>
#include <vector>

namespace flexel {

// A text as a field of a row.
[[nodiscard]] std::string csv_field(const std::string& text);

// Takes the next row; false where there is none.
[[nodiscard]] bool read_csv_row(std::istream& in, std::vector<std::string>& fields);

}  // namespace flexel
