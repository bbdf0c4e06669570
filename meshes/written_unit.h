// Units that a file says and assimp passes over.
#pragma once
#include <string_view>

namespace flexel::meshes {

// Metres per unit of the coordinates in the text of a Collada (.dae), AMF, X3D or DXF file, or what the format prescribes
// where the text says nothing; 0: neither does.
[[nodiscard]] double written_unit(std::string_view format, std::string_view text);

}  // namespace flexel::meshes
