// The elastic law of a material: its keys in [materials.NAME].
#pragma once
#include <optional>

#include "simulate/input/materials.h"
#include "simulate/input/scene_table.h"

namespace flexel::simulate {

// Reads "law" and its constants. Throws InputError: an unknown law, a missing constant, constants of a material
// that is not stable.
void parse_law(TableReader& reader, Material& material);

// "axes" of [parts.NAME]: two directions, of the material's first axis and of its second one. Throws InputError.
[[nodiscard]] std::optional<Mat3> parse_axes(TableReader& reader);

}  // namespace flexel::simulate
