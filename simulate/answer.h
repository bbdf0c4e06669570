// The answer of a run as its user needs it: at most six lines (docs/guide/deform.md, "What is said").
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/input/materials.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

// "how far", "how sure", "strength", "held by", "next" and one more for probes. `next` says what to do next,
// "" for what this result suggests itself: cells of half the size, which `size_option` asks for. `body` is
// the deformed one, `materials` (parts) those of its parts.
[[nodiscard]] std::vector<std::string> answer_lines(
    const SimulateResult& result, const Body& body, const std::vector<Material>& materials,
    const std::string& next = "", const std::string& size_option = "flexel-voxelize --size");

}  // namespace flexel::simulate
