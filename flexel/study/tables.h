// A study as tables and JSON.
#pragma once
#include <string>
#include <vector>

#include "flexel/study/study.h"

namespace flexel::study {

// study.csv (docs/guide/study.md gives its columns): one line of names, one line a row. `quantities` are the names
// of the last columns.
[[nodiscard]] std::string csv_header(const std::vector<Quantity>& quantities);
[[nodiscard]] std::string csv_line(std::size_t number, const Row& row,
                                   const std::vector<Quantity>& quantities);
// All of it, as JSON in SI units.
[[nodiscard]] std::string study_json(const Study& study);
// The prediction for each run beside its cost: a table for a terminal.
[[nodiscard]] std::string prediction_table(const Study& study);

}  // namespace flexel::study
