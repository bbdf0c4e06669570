// X3D made fit for assimp.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel::meshes {

struct X3dDocument {
  Bytes bytes;  // the file with a copy in place of each USE, without empty groups, points and lines
  std::size_t shapes = 0;  // geometries of polygons that it then shows
  std::size_t lines = 0;   // others, which are left out: assimp makes polygons of long lines
};

// assimp 5.2 leaves the node that it is in once too often after a group that is used again or empty, and puts all that
// follows elsewhere or nowhere, in silence. Throws InputError(where, ...): no XML, a USE of what is not there, or more
// copies than memory is for.
[[nodiscard]] X3dDocument x3d_document(const Bytes& bytes, const std::string& where);

}  // namespace flexel::meshes
