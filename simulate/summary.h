// A result for people and for programs.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/input/materials.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

// The result as JSON (docs/reference/summary.md gives every key and unit). `body` is the deformed one, `materials` (parts) those of its parts.
// `told`: the warnings of the run that were printed; they are in it, and those that the result alone gives.
[[nodiscard]] std::string summary_json(const SimulateResult& result, const Body& body,
                                       const std::vector<Material>& materials,
                                       const std::vector<std::string>& told = {});

// What its lattice does not resolve, of the notes that voxelizing left; part by part where there are several.
[[nodiscard]] std::vector<std::string> unresolved(const Body& body);

// The result in lines for people.
[[nodiscard]] std::vector<std::string> summary_lines(const SimulateResult& result);

}  // namespace flexel::simulate
