// DXF made fit for assimp.
#pragma once
#include <map>
#include <string>
#include <string_view>

#include "base/files/files.h"

namespace flexel::meshes {

struct DxfDocument {
  Bytes bytes;                        // the file with visible edges only
  double unit = 0;                    // metres; 0: the file does not say
  std::map<std::string, int> others;  // entities that are no polygons, by kind: they are left out
};

// assimp 5.2 drops faces that have invisible edges (negative vertex numbers), solids and polygon meshes, puts blocks
// elsewhere, and reads what is left of a file that is cut off, all in silence. Throws InputError(where, ...) for what cannot
// be mended here: all but the first.
[[nodiscard]] DxfDocument dxf_document(std::string_view text, const std::string& where);

}  // namespace flexel::meshes
