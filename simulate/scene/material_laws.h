// The elastic law of a material: its keys in [materials.NAME], and which parts can have it.
#pragma once
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Reads "law" and its constants. Throws InputError: an unknown law, a missing constant, constants of a material
// that is not stable.
void parse_law(TableReader& reader, Material& material);

// "axes" of [parts.NAME]: two directions, of the material's first axis and of its second one. Throws InputError.
[[nodiscard]] std::optional<Mat3> parse_axes(TableReader& reader);

// Throws InputError, one line: a law but neo-Hooke's with another model than cells, an infill, a rest shape of
// its own, or axes for a law that has none. `settings` of part `p`, `material` without the part's axes.
void refuse_law(const Scene& scene, const PartSettings& settings, const Body& body, std::size_t p,
                const Material& material, const std::string& model);

}  // namespace flexel::simulate
