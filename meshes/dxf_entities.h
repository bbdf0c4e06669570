// What a DXF file holds that assimp passes over in silence.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace flexel::meshes {

// How many of the entities are no polygons (lines, texts, dimensions): they are left out. Throws InputError(where, ...) for
// those that have a surface and that assimp 5.2 drops or puts elsewhere: solids, blocks that are inserted, polygon meshes.
[[nodiscard]] std::size_t check_dxf_entities(std::string_view text, const std::string& where);

}  // namespace flexel::meshes
