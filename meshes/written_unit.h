// Units that assimp passes over, or rounds to single precision.
#pragma once
#include <string>
#include <string_view>

namespace flexel::meshes {

// Metres per unit of the coordinates in the text of a Collada file (.dae), or what the format prescribes; 0: nothing does.
// Throws InputError(where, ...): the unit of a Collada file is no length.
[[nodiscard]] double written_unit(std::string_view format, std::string_view text, const std::string& where);

}  // namespace flexel::meshes
