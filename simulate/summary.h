// A result for people and for programs.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

// The result as JSON (docs/reference/summary.md gives every key and unit).
[[nodiscard]] std::string summary_json(const SimulateResult& result, const Body& body);

// The result in lines for people.
[[nodiscard]] std::vector<std::string> summary_lines(const SimulateResult& result);

}  // namespace flexel::simulate
